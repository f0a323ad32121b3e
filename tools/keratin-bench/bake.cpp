// Speed and memory of keratin-bake, as the program itself reports them.
#include "tools/keratin-bench/programs.h"
#include "tools/keratin-bench/sections.h"

#include <nlohmann/json.hpp>

#include <limits>

namespace keratin::bench {

namespace {

struct Cost {
    double seconds = std::numeric_limits<double>::max();  // CPU time of the busiest thread
    double utilisation = 1;
    double peak_mbytes = 0;
};

Cost bake(const Scratch& folder, const std::string& recipe, int threads, int repeats) {
    Cost best;
    for (int i = 0; i < repeats; ++i) {
        const Ran ran = run_program("keratin-bake", recipe + " -o " + (folder / "baked.kera") +
                                                        " --json --threads " +
                                                        std::to_string(threads));
        const auto report = nlohmann::json::parse(ran.out);
        const auto& cost = report["cost"];
        const double busiest = cost["busiest_cpu_seconds"];
        best.peak_mbytes =
            std::max(best.peak_mbytes, cost["peak_bytes"].get<double>() * 1e-6);
        if (busiest >= best.seconds) continue;
        best.seconds = busiest;
        best.utilisation = cost["cpu_seconds"].get<double>() / (threads * busiest);
    }
    return best;
}

void add(Report& report, const std::string& name, const std::string& recipe,
         const Scratch& folder, int repeats, double most_seconds,
         std::optional<double> most_mbytes, std::optional<double> least_speed_up) {
    const auto row = [&](const std::string& what, double value, const char* unit, int threads) -> Row& {
        Row& out = report.rows.emplace_back();
        out.name = "bake: " + name + what;
        out.value = value;
        out.unit = unit;
        out.threads = threads;
        return out;
    };
    const int asked = report.options.threads;
    const int several = asked > 1 ? asked : 2;
    Cost one;
    if (asked <= 1) {
        one = bake(folder, recipe, 1, repeats);
        row("", one.seconds, "s", 1).target = most_seconds;
        row(", most memory", one.peak_mbytes, "MB", 1).target = most_mbytes;
    }
    if (asked == 1) return;
    const Cost more = bake(folder, recipe, several, repeats);
    row(", busiest thread", more.seconds, "s", several).utilisation = more.utilisation;
    if (asked != 0) return;
    Row& speed_up = row(": two threads over one", one.seconds / more.seconds, "x", several);
    speed_up.target = least_speed_up;
    speed_up.smaller_is_better = false;
    speed_up.utilisation = more.utilisation;
}

}  // namespace

void bake_section(Report& report) {
    const Scratch folder;
    add(report, "bear, 48 113 strands on 57 784 triangles", KERATIN_DATA_DIR "/bear/bear.json",
        folder, report.options.repeats(), 2, 300, std::nullopt);
    if (report.options.quick) return;
    // Half a minute each: the smallest of a few.
    constexpr int kRepeats = 3;
    add(report, "1 000 000 strands of 16 points", write_groom(folder, "million", 1000000), folder,
        kRepeats, 60, std::nullopt, 1.7);
}

}  // namespace keratin::bench
