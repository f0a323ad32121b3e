// keratin-diff: compares two assets, for people and for build pipelines.
#include "schema/files/write_file.h"
#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/judge.h"
#include "tools/keratin-diff/report_json.h"
#include "tools/keratin-diff/report_text.h"
#include "tools/keratin-diff/summary.h"

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

For git: put "*.kera diff=keratin" into .gitattributes and run
  git config diff.keratin.textconv "keratin-diff --text"
  git config diff.keratin.cachetextconv true

Exit codes: 0 nothing beyond the limits, 1 the assets differ, 2 wrong usage or bad input,
3 an internal fault.)";

struct Arguments {
    std::string a, b, text_of, junit;
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
    return kSame;
}

int compare_files(const Arguments& arguments) {
    diff::Tolerances tolerances;
    for (const std::string& text : arguments.warn)
        if (auto ok = tolerances.set_warn(text); !ok) return report_error(ok.error());
    for (const std::string& text : arguments.fail)
        if (auto ok = tolerances.set_fail(text); !ok) return report_error(ok.error());
    const auto a = AssetView::open(arguments.a);
    if (!a) return report_error(a.error());
    const auto b = AssetView::open(arguments.b);
    if (!b) return report_error(b.error());

    const diff::Report report = diff::compare(*a, *b);
    const std::vector<diff::Finding> findings = diff::judge(report, tolerances);
    const bool passed = std::none_of(findings.begin(), findings.end(), [&](const auto& finding) {
        return finding.severity == diff::Severity::failure ||
               (arguments.strict && finding.severity == diff::Severity::warning);
    });
    if (!arguments.junit.empty()) {
        const std::string junit =
            diff::report_junit(report, findings, arguments.a, arguments.b, arguments.strict);
        if (auto ok = write_file(arguments.junit, junit); !ok) return report_error(ok.error());
    }
    if (arguments.json)
        std::fputs(
            diff::report_json(report, findings, arguments.a, arguments.b, passed, KERATIN_VERSION)
                .c_str(),
            stdout);
    else if (!arguments.quiet)
        std::fputs(diff::report_text(report, findings).c_str(), stdout);
    return passed ? kSame : kDifferent;
}

int run(int argc, char** argv) {
    Arguments arguments;
    CLI::App app("Compares two assets and names what changed, with the worst offender.",
                 "keratin-diff");
    app.footer(kFooter);
    app.set_version_flag("--version", "keratin-diff " KERATIN_VERSION ", asset revision " +
                                          std::to_string(kAssetMajor) + "." +
                                          std::to_string(kAssetMinor));
    auto* a = app.add_option("a", arguments.a, "the first asset (*.kera)");
    auto* b = app.add_option("b", arguments.b, "the second asset");
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
    app.add_flag("--quiet", arguments.quiet, "print nothing but errors");
    auto* text = app.add_option("--text", arguments.text_of,
                                "print a short stable text of one asset instead");
    a->excludes(text);
    b->excludes(text);
    json->excludes(text);
    try {
        app.parse(argc, argv);
        if (!*text && !*b) throw CLI::RequiredError("two assets, a.kera b.kera,");
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? kSame : kWrongUse;
    }
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
