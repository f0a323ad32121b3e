// keratin-diff: compares two assets or two cached runs, for people and for build pipelines.
#include "schema/files/program.h"
#include "schema/files/write_file.h"
#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/compare_runs.h"
#include "tools/keratin-diff/judge.h"
#include "tools/keratin-diff/report_json.h"
#include "tools/keratin-diff/report_text.h"
#include "tools/keratin-diff/summary.h"
#ifdef KERATIN_WITH_VIEW
#include "tools/keratin-view/difference.h"
#endif

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

using namespace keratin;

namespace {

constexpr int kSame = 0, kDifferent = 1, kWrongUse = 2, kOurFault = 3;

constexpr char kFooter[] = R"(
Strands are matched by id, or by root and shape where ids changed, never by their place in the file.
Lengths are in metres; a tolerance may also be written in mm or um.

Without limits every difference in data and settings fails, and one in the recipe, the inputs or
the tool version warns. For number fields a limit is the largest difference allowed, for all others
how many items may differ.

  keratin-diff old.kera new.kera --fail strand_position=0.5mm --warn strand_uv=0.001
  keratin-diff old.kera new.kera --warn 'settings=0' --junit diff.xml

Cached runs are compared frame by frame and point by point; their fields are frames, strands,
guide_position, strand_position, body_position, time and assets (assets only warns).

For git: put "*.kera diff=keratin" into .gitattributes and run
  git config diff.keratin.textconv "keratin-diff --text"
  git config diff.keratin.cachetextconv true

Exit codes: 0 nothing beyond the limits, 1 the assets differ, 2 wrong usage or bad input,
3 an internal fault.)";

struct Arguments {
    std::string a, b, text_of, junit, image;
    std::vector<std::string> warn, fail;
    bool strict = false, quiet = false, json = false;
};

int report_error(const Error& error) {
    std::fprintf(stderr, "keratin-diff: %s\n", to_string(error).c_str());
    return exit_code(error);
}

int print_summary(const Arguments& arguments) {
    const auto asset = AssetView::open(arguments.text_of);
    if (!asset) return report_error(asset.error());
    std::fputs(diff::summary_text(*asset).c_str(), stdout);
    if (auto ok = finish_stdout(); !ok) return report_error(ok.error());
    return kSame;
}

Result<diff::Tolerances> tolerances_of(const Arguments& arguments,
                                       std::vector<diff::Subject> subjects) {
    diff::Tolerances tolerances(std::move(subjects));
    for (const std::string& text : arguments.warn)
        if (auto ok = tolerances.set_warn(text); !ok) return ok.error();
    for (const std::string& text : arguments.fail)
        if (auto ok = tolerances.set_fail(text); !ok) return ok.error();
    return tolerances;
}

// What a comparison prints and writes.
struct Texts {
    std::vector<diff::Finding> findings;
    std::string text, json, junit;
};

bool passes(const Arguments& arguments, const std::vector<diff::Finding>& findings) {
    return std::none_of(findings.begin(), findings.end(), [&](const auto& finding) {
        return finding.severity == diff::Severity::failure ||
               (arguments.strict && finding.severity == diff::Severity::warning);
    });
}

Result<Texts> compare_assets(const Arguments& arguments) {
    const auto tolerances = tolerances_of(arguments, diff::asset_subjects());
    if (!tolerances) return tolerances.error();
    const auto a = AssetView::open(arguments.a);
    if (!a) return a.error();
    const auto b = AssetView::open(arguments.b);
    if (!b) return b.error();
    const diff::Report report = diff::compare(*a, *b);
    Texts out;
    out.findings = diff::judge(report, *tolerances);
    out.text = diff::report_text(report, out.findings);
    out.json = diff::report_json(report, out.findings, arguments.a, arguments.b,
                                 passes(arguments, out.findings), KERATIN_VERSION);
    out.junit =
        diff::report_junit(report, out.findings, arguments.a, arguments.b, arguments.strict);
    return out;
}

Result<Texts> compare_caches(const Arguments& arguments) {
    const auto tolerances = tolerances_of(arguments, diff::run_subjects());
    if (!tolerances) return tolerances.error();
    const auto a = CacheReader::open(arguments.a);
    if (!a) return a.error();
    const auto b = CacheReader::open(arguments.b);
    if (!b) return b.error();
    const auto differences = diff::compare_runs(*a, *b);
    if (!differences) return differences.error();
    const auto describe = [&](const std::string& name) {
        return diff::describe(*differences, name);
    };
    Texts out;
    out.findings = diff::judge(*differences, *tolerances);
    out.text = diff::findings_text(out.findings, describe);
    if (out.text.empty()) out.text = "the runs show the same\n";
    out.json = diff::runs_json(*differences, out.findings, arguments.a, arguments.b,
                               passes(arguments, out.findings), KERATIN_VERSION);
    out.junit =
        diff::findings_junit(out.findings, describe, arguments.a, arguments.b, arguments.strict);
    return out;
}

bool is_cached_run(const std::string& path) { return path.ends_with(".kcache"); }

#ifdef KERATIN_WITH_VIEW
// The last frame of a run, or an asset at rest.
Result<view::Subject> last_subject(const std::string& path) {
    const auto source = view::open_source(path, "");
    if (!source) return source.error();
    const std::size_t count = view::frame_count(*source);
    if (count == 0) return Error{ErrorCode::input, path, "holds no frames"};
    return view::subject_at(*source, count - 1);
}

Result<void> write_image(const Arguments& arguments) {
    const auto a = last_subject(arguments.a);
    if (!a) return a.error();
    const auto b = last_subject(arguments.b);
    if (!b) return b.error();
    const auto drawn = view::draw_difference(*a, *b);
    if (!drawn) return drawn.error();
    return view::write_png(drawn->image, arguments.image);
}
#else
Result<void> write_image(const Arguments&) {
    return Error{ErrorCode::unsupported, "--image",
                 "this build draws nothing: it was made without Embree"};
}
#endif

int compare_files(const Arguments& arguments) {
    const OutputFile outputs[] = {{"--junit", arguments.junit}, {"--image", arguments.image}};
    const std::string inputs[] = {arguments.a, arguments.b};
    if (auto ok = check_outputs(outputs, inputs); !ok) return report_error(ok.error());
    if (is_cached_run(arguments.a) != is_cached_run(arguments.b))
        return report_error({ErrorCode::usage, arguments.b,
                             "an asset and a cached run cannot be compared with each other"});
    const auto texts =
        is_cached_run(arguments.a) ? compare_caches(arguments) : compare_assets(arguments);
    if (!texts) return report_error(texts.error());
    if (!arguments.junit.empty())
        if (auto ok = write_file(arguments.junit, texts->junit); !ok)
            return report_error(ok.error());
    if (!arguments.image.empty())
        if (auto ok = write_image(arguments); !ok) return report_error(ok.error());
    if (arguments.json)
        std::fputs(texts->json.c_str(), stdout);
    else if (!arguments.quiet)
        std::fputs(texts->text.c_str(), stdout);
    if (auto ok = finish_stdout(); !ok) return report_error(ok.error());
    return passes(arguments, texts->findings) ? kSame : kDifferent;
}

int wrong_use(const std::string& what) {
    std::fprintf(stderr, "keratin-diff: %s; see keratin-diff --help\n", what.c_str());
    return kWrongUse;
}

int run(int argc, char** argv) {
    leave_nothing_behind();
    Arguments arguments;
    CLI::App app(
        "Compares two assets or two cached runs and names what changed, with the worst "
        "offender.",
        "keratin-diff");
    app.footer(kFooter);
    app.set_version_flag("--version", "keratin-diff " KERATIN_VERSION ", asset revision " +
                                          std::to_string(kAssetMajor) + "." +
                                          std::to_string(kAssetMinor) + ", cache revision " +
                                          std::to_string(kCacheMajor) + "." +
                                          std::to_string(kCacheMinor));
    auto* a = app.add_option("a", arguments.a, "the first asset (*.kera) or cached run (*.kcache)");
    auto* b = app.add_option("b", arguments.b, "the second asset or cached run");
    app.add_option("--warn", arguments.warn,
                   "FIELD=V: list FIELD as a warning when it differs by "
                   "more than V; * in FIELD stands for any text")
        ->take_all()
        ->allow_extra_args(false);
    app.add_option("--fail,--tolerance", arguments.fail,
                   "FIELD=V: exit with 1 when FIELD differs by more than V")
        ->take_all()
        ->allow_extra_args(false);
    app.add_flag("--strict", arguments.strict, "exit with 1 on warnings too");
    auto* json = app.add_flag("--json", arguments.json,
                              "print one JSON document (schema/report/keratin-diff.schema.json)");
    app.add_option("--junit", arguments.junit, "write a JUnit file");
    app.add_option("--image", arguments.image,
                   "draw b as PNG, coloured by its distance from a (strands of the same id; of "
                   "runs the last frame)");
    app.add_flag("--quiet", arguments.quiet, "print nothing but errors");
    auto* text = app.add_option("--text", arguments.text_of,
                                "print a short stable text of one asset instead");
    a->excludes(text);
    b->excludes(text);
    json->excludes(text);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& asked) {
        return app.exit(asked);
    } catch (const CLI::ParseError& error) {
        return wrong_use(error.what());
    }
    if (!*text && !*b) return wrong_use("two assets or cached runs are needed, a.kera b.kera");
    return *text ? print_summary(arguments) : compare_files(arguments);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "keratin-diff: internal fault: %s\n", error.what());
        return kOurFault;
    }
}
