// keratin-report: measures the solvers against references and under stress.
#include "schema/asset.h"
#include "schema/files/program.h"
#include "schema/files/write_file.h"
#include "tools/keratin-report/case.h"
#include "tools/keratin-report/convergence.h"
#include "tools/keratin-report/print.h"
#include "tools/keratin-report/stability.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>

namespace {

using namespace keratin;
using namespace keratin::report;

constexpr int kDone = 0, kFailed = 1, kWrongUse = 2, kOurFault = 3;
constexpr const char* kSchema = "hair-validation-1";

constexpr const char* kFooter =
    "validate runs every case of a file and compares what it measures with the case's reference.\n"
    "stability runs its robustness cases and holds what it measures against their criteria.\n"
    "A case that the solver cannot express is listed as not applicable, with the reason.\n"
    "curve draws how the iterations of a run's last step converge.\n"
    "\n"
    "  keratin-report validate data/validation/public.json\n"
    "  keratin-report validate cases.json --family cantilever --json\n"
    "  keratin-report stability data/validation/public.json --solver strand -o results\n"
    "  keratin-report curve run.json -o run.svg\n"
    "\n"
    "Exit codes: 0 every case that was run passed, 1 one failed, 2 wrong usage or bad input,\n"
    "3 a fault of the program.";

constexpr const char* kCurveFooter =
    "An SVG picture over the number of the iteration, on a logarithmic axis: the mean change of\n"
    "the velocities and of the impulses, and the mean Coulomb residual where there is contact. An\n"
    "arrowhead at the lower edge stands for zero.\n"
    "\n"
    "  keratin-run data/scenes/contact/two_strands.json --convergence --stats two_strands.json\n"
    "  keratin-report curve two_strands.json -o two_strands.svg\n"
    "\n"
    "Exit codes: 0 done, 2 wrong usage or bad input, 3 a fault of the program.";

struct Arguments {
    std::string cases, solver = "rod", family, id, junit, folder;
    std::string stats, picture, title, size;
    bool json = false, quiet = false;
};

int report_error(const Error& error) {
    std::fprintf(stderr, "keratin-report: %s\n", to_string(error).c_str());
    return exit_code(error);
}

Result<Json> read_cases(const std::string& path) {
    std::ifstream file(path);
    if (!file) return Error{ErrorCode::io, path, "cannot be read"};
    Json document = Json::parse(file, nullptr, false, true);
    if (document.is_discarded()) return Error{ErrorCode::input, path, "is not JSON"};
    if (!document.is_object() || document.value("schema", "") != kSchema)
        return Error{ErrorCode::input, path, std::string("must say \"schema\": \"") + kSchema + "\""};
    return document;
}

int finish(const Arguments& a, const char* command, const std::vector<Outcome>& outcomes) {
    if (!a.junit.empty())
        if (auto ok = write_file(a.junit, outcomes_junit(command, outcomes)); !ok) return report_error(ok.error());
    if (a.json)
        std::fputs(outcomes_json(command, a.solver, outcomes).c_str(), stdout);
    else if (!a.quiet)
        std::fputs(summary_text(outcomes).c_str(), stdout);
    return all_passed(outcomes) ? kDone : kFailed;
}

void print_one(const Arguments& a, const Outcome& outcome) {
    if (a.json || a.quiet) return;
    std::fputs(outcome_text(outcome).c_str(), stdout);
    std::fflush(stdout);
}

int validate(const Arguments& a) {
    if (a.solver != "rod")
        return report_error({ErrorCode::unsupported, "--solver", "validate runs the rod solver"});
    const auto document = read_cases(a.cases);
    if (!document) return report_error(document.error());
    if (!document->contains("cases") || !(*document)["cases"].is_array())
        return report_error({ErrorCode::input, a.cases, "has no list \"cases\""});
    std::vector<Outcome> outcomes;
    std::size_t number = 0;
    for (const Json& test : (*document)["cases"]) {
        const std::string where = a.cases + ": cases[" + std::to_string(number++) + "]";
        try {
            if (!a.family.empty() && test.at("family") != a.family) continue;
            if (!a.id.empty() && test.at("id") != a.id) continue;
            outcomes.push_back(run_case(test));
        } catch (const Json::exception& error) {
            return report_error({ErrorCode::input, where, error.what()});
        }
        print_one(a, outcomes.back());
    }
    if (outcomes.empty()) return report_error({ErrorCode::usage, a.cases, "no case matches --family and --case"});
    return finish(a, "validate", outcomes);
}

// The report as files of its own: SOLVER.json and SOLVER.xml in the folder.
Result<void> write_folder(const Arguments& a, const char* command, const std::vector<Outcome>& outcomes) {
    if (a.folder.empty()) return {};
    std::error_code failed;
    std::filesystem::create_directories(a.folder, failed);
    if (failed) return Error{ErrorCode::io, a.folder, "cannot be made: " + failed.message()};
    const std::string stem = a.folder + "/" + command + "-" + a.solver;
    if (auto ok = write_file(stem + ".json", outcomes_json(command, a.solver, outcomes)); !ok) return ok;
    return write_file(stem + ".xml", outcomes_junit(command, outcomes));
}

int stability(const Arguments& a) {
    const StressSolver* solver = find_stress_solver(a.solver);
    if (!solver) return report_error({ErrorCode::unsupported, "--solver " + a.solver, "stability does not run it"});
    const auto document = read_cases(a.cases);
    if (!document) return report_error(document.error());
    const auto cases = read_stress(*document, a.cases);
    if (!cases) return report_error(cases.error());
    std::vector<Outcome> outcomes;
    for (const StressCase& test : *cases) {
        if (!a.id.empty() && test.id != a.id) continue;
        outcomes.push_back(run_stress(test, *solver));
        print_one(a, outcomes.back());
    }
    if (outcomes.empty()) return report_error({ErrorCode::usage, a.cases, "no robustness case matches --case"});
    if (auto ok = write_folder(a, "stability", outcomes); !ok) return report_error(ok.error());
    return finish(a, "stability", outcomes);
}

// "WIDTHxHEIGHT"; an empty text leaves what is there.
Result<void> parse_size(const std::string& text, chart::Chart& chart) {
    if (text.empty()) return {};
    char rest = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &chart.width, &chart.height, &rest) == 2 &&
        std::min(chart.width, chart.height) >= chart::kLeastSide &&
        std::max(chart.width, chart.height) <= chart::kLargestSide)
        return {};
    return Error{ErrorCode::usage, "--size",
                 "'" + text + "' is not a size in pixels such as 720x440, " +
                     std::to_string(chart::kLeastSide) + " to " +
                     std::to_string(chart::kLargestSide) + " a side"};
}

// What one of the quantities drawn does from the first iteration to the last.
Json course(const chart::Line& line) {
    return {{"name", line.name},
            {"points", line.x.size()},
            {"first", line.y.front()},
            {"last", line.y.back()}};
}

Result<void> draw_curve(const Arguments& a) {
    const std::filesystem::path picture(a.picture);
    if (picture.has_extension() && picture.extension() != ".svg")
        return Error{ErrorCode::usage, "-o " + a.picture,
                     "the picture is SVG; end its name in .svg"};
    const OutputFile outputs[] = {{"-o", a.picture}};
    const std::string inputs[] = {a.stats};
    if (auto ok = check_outputs(outputs, inputs); !ok) return ok;
    const auto convergence = read_convergence(a.stats);
    if (!convergence) return convergence.error();
    auto chart = convergence_chart(
        *convergence, a.title.empty()
                          ? "The last step of " + std::filesystem::path(a.stats).stem().string()
                          : a.title);
    if (auto ok = parse_size(a.size, chart); !ok) return ok;
    const auto svg = chart::to_svg(chart);
    if (!svg) return svg.error();
    if (auto ok = write_file(a.picture, *svg); !ok) return ok;
    if (a.json) {
        Json document = {{"command", "curve"},
                         {"version", KERATIN_VERSION},
                         {"input", a.stats},
                         {"output", a.picture},
                         {"width", chart.width},
                         {"height", chart.height},
                         {"iterations", convergence->dv.size()},
                         {"lines", Json::array()}};
        for (const chart::Line& line : chart.lines) document["lines"].push_back(course(line));
        std::printf("%s\n", document.dump(1).c_str());
    } else if (!a.quiet) {
        std::printf("%s: %zu iteration%s\n", a.picture.c_str(), convergence->dv.size(),
                    convergence->dv.size() == 1 ? "" : "s");
        for (const chart::Line& line : chart.lines)
            std::printf("    %-24s %.3g to %.3g\n", line.name.c_str(), line.y.front(),
                        line.y.back());
    }
    return finish_stdout();
}

int curve(const Arguments& a) {
    const auto done = draw_curve(a);
    return done ? kDone : report_error(done.error());
}

int run(int argc, char** argv) {
    Arguments arguments;
    CLI::App app("Measures the solvers against references and under stress.", "keratin-report");
    app.footer(kFooter);
    app.require_subcommand(1);
    app.set_version_flag("--version", "keratin-report " KERATIN_VERSION ", asset revision " +
                                          std::to_string(kAssetMajor) + "." + std::to_string(kAssetMinor));
    const auto common = [&](CLI::App* command) {
        command->add_option("cases", arguments.cases, "a file of the schema hair-validation-1")->required();
        command->add_option("--solver", arguments.solver, "rod (stability: also strand)");
        command->add_option("--case", arguments.id, "run the case with this id only");
        command->add_flag("--json", arguments.json,
                          "print one JSON document (schema/report/keratin-report.schema.json)");
        command->add_option("--junit", arguments.junit, "write a JUnit file");
        command->add_flag("--quiet", arguments.quiet, "print nothing but errors");
    };
    auto* validation = app.add_subcommand("validate", "compare with closed forms and reference solutions");
    common(validation);
    validation->add_option("--family", arguments.family, "run the cases of this family only");
    auto* stress = app.add_subcommand("stability", "run the robustness cases of a file");
    common(stress);
    stress->add_option("-o", arguments.folder, "folder for the report as JSON and JUnit");
    auto* convergence = app.add_subcommand("curve", "draw how a run's last step converges");
    convergence->footer(kCurveFooter);
    convergence
        ->add_option("stats", arguments.stats, "what keratin-run --convergence --stats FILE wrote")
        ->required();
    convergence->add_option("-o,--output", arguments.picture, "SVG picture to write")->required();
    convergence->add_option("--title", arguments.title,
                            "above the curve; default: the last step of the file's name");
    convergence->add_option("--size", arguments.size, "WIDTHxHEIGHT in pixels; default 720x440");
    convergence->add_flag(
        "--json", arguments.json,
        "print one JSON document (schema/report/keratin-report-curve.schema.json)");
    convergence->add_flag("--quiet", arguments.quiet, "print nothing but errors");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);
        std::fprintf(stderr, "keratin-report: %s (keratin-report --help explains)\n", error.what());
        return kWrongUse;
    }
    if (*convergence) return curve(arguments);
    return *stress ? stability(arguments) : validate(arguments);
}

}  // namespace

int main(int argc, char** argv) {
    keratin::wait_sleeping(argv);
    keratin::leave_nothing_behind();
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "keratin-report: internal fault: %s\n", error.what());
        return kOurFault;
    }
}
