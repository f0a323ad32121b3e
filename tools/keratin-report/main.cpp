// keratin-report: measures the solvers against references and under stress.
#include "schema/asset.h"
#include "schema/files/write_file.h"
#include "tools/keratin-report/case.h"
#include "tools/keratin-report/print.h"
#include "tools/keratin-report/stability.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

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
    "\n"
    "  keratin-report validate data/validation/public.json\n"
    "  keratin-report validate cases.json --family cantilever --json\n"
    "  keratin-report stability data/validation/public.json --solver strand -o results\n"
    "\n"
    "Exit codes: 0 every case that was run passed, 1 one failed, 2 wrong usage or bad input,\n"
    "3 a fault of the program.";

struct Arguments {
    std::string cases, solver = "rod", family, id, junit, folder;
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
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? kDone : kWrongUse;
    }
    return *stress ? stability(arguments) : validate(arguments);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "keratin-report: internal fault: %s\n", error.what());
        return kOurFault;
    }
}
