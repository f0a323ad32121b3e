// keratin-bench: speed and memory, as figures and as ratios to reference loops in the same process.
#include "schema/asset.h"
#include "schema/files/program.h"
#include "tools/keratin-bench/sections.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>

using namespace keratin;
using namespace keratin::bench;

namespace {

void print_table(const Report& report) {
    std::printf("%s, %d cores, %s: %.0f GFLOP/s multiply-add, %.0f GB/s copy (one thread)\n",
                report.machine.processor.c_str(), report.machine.cores,
                report.machine.instruction_set.c_str(), report.machine.fma_gflops,
                report.machine.copy_gbytes);
    if (!report.machine.like_reference)
        std::printf("Targets in ns and ms were set on a faster core and are not judged here.\n");
    std::printf("%-58s %10s %-18s %8s %4s %7s %7s %5s\n", "", "value", "unit", "target", "",
                "x naive", "threads", "busy");
    for (const Row& row : report.rows) {
        const auto ok = row.ok(report.machine);
        char target[24] = "", ratio[24] = "", busy[24] = "";
        if (row.target)
            std::snprintf(target, sizeof target, "%s%g",
                          row.smaller_is_better ? "<=" : ">=", *row.target);
        if (row.ratio_to_reference)
            std::snprintf(ratio, sizeof ratio, "%.1f", *row.ratio_to_reference);
        if (row.utilisation) std::snprintf(busy, sizeof busy, "%.0f%%", *row.utilisation * 100);
        std::printf("%-58s %10.4g %-18s %8s %4s %7s %7d %5s\n", row.name.c_str(), row.value,
                    row.unit.c_str(), target,
                    !ok   ? ""
                    : *ok ? "ok"
                          : "NO",
                    ratio, row.threads, busy);
    }
}

nlohmann::ordered_json to_json(const Report& report) {
    nlohmann::ordered_json out;
    const Machine& m = report.machine;
    out["machine"] = {{"processor", m.processor},
                      {"instruction_set", m.instruction_set},
                      {"cores", m.cores},
                      {"fma_gflops", m.fma_gflops},
                      {"copy_gbytes_per_s", m.copy_gbytes},
                      {"like_reference", m.like_reference}};
    out["results"] = nlohmann::ordered_json::array();
    for (const Row& row : report.rows) {
        nlohmann::ordered_json r;
        r["name"] = row.name;
        r["value"] = row.value;
        r["unit"] = row.unit;
        r["target"] = row.target ? nlohmann::ordered_json(*row.target) : nullptr;
        const auto ok = row.ok(m);
        r["ok"] = ok ? nlohmann::ordered_json(*ok) : nullptr;
        r["ratio_to_reference"] =
            row.ratio_to_reference ? nlohmann::ordered_json(*row.ratio_to_reference) : nullptr;
        r["threads"] = row.threads;
        r["utilisation"] = row.utilisation ? nlohmann::ordered_json(*row.utilisation) : nullptr;
        out["results"].push_back(r);
    }
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    keratin::wait_sleeping(argv);
    CLI::App app{
        "Measures speed and memory of the solvers. Values are CPU time, the smallest of 20 "
        "repeats or more."};
    app.set_version_flag("--version", "keratin-bench 0.1.0 (asset format " +
                                          std::to_string(kAssetMajor) + "." +
                                          std::to_string(kAssetMinor) + ")");
    std::string names, long_names;
    for (const Section& s : kSections) {
        names += std::string(names.empty() ? "" : ", ") + s.name;
        if (s.on_request) long_names += std::string(long_names.empty() ? "" : ", ") + s.name;
    }
    std::vector<std::string> wanted;
    Options options;
    bool json = false, quiet = false;
    app.add_option("section", wanted, "What to measure: " + names + "; when left out, all but " + long_names);
    app.add_flag("--quick", options.quick, "Fewer repeats and the small sizes only");
    app.add_option("--threads", options.threads, "Threads; both 1 and 2 when left out")
        ->check(CLI::Range(1, 256));
    app.add_flag("--json", json, "One JSON document on standard output");
    app.add_flag("--quiet", quiet, "Print nothing for people");
    app.footer(
        "Exit codes: 0 every bound that holds on this machine is met, 1 one is missed, 2 wrong "
        "usage.");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? 0 : 2;
    }
    for (const std::string& name : wanted)
        if (std::none_of(std::begin(kSections), std::end(kSections),
                         [&](const Section& s) { return name == s.name; })) {
            std::fprintf(stderr, "keratin-bench: there is no section `%s`; there are: %s\n",
                         name.c_str(), names.c_str());
            return 2;
        }

    const Machine machine = measure_machine();
    Report report{options, machine, {}};
    for (const Section& section : kSections)
        if (wanted.empty()
                ? !section.on_request
                : std::find(wanted.begin(), wanted.end(), section.name) != wanted.end()) {
            if (!quiet) std::fprintf(stderr, "measuring %s: %s\n", section.name, section.what);
            section.run(report);
        }
    if (json)
        std::printf("%s\n", to_json(report).dump(2).c_str());
    else if (!quiet)
        print_table(report);
    for (const Row& row : report.rows)
        if (row.ok(machine) == false) return 1;
    return 0;
}
