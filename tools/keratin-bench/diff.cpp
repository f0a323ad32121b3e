// Speed of keratin-diff.
#include "tools/keratin-bench/programs.h"
#include "tools/keratin-bench/sections.h"

#include <limits>

namespace keratin::bench {

void diff_section(Report& report) {
    constexpr std::uint32_t kStrands = 100000;
    const Scratch folder;
    const auto bake = [&](const std::string& name, std::uint32_t moved_every) {
        run_program("keratin-bake", write_groom(folder, name, kStrands, moved_every) + " -o " +
                                        (folder / (name + ".kera")) + " --quiet");
    };
    bake("before", 0);
    const auto measure = [&](const std::string& name, const std::string& after, int code) {
        double least = std::numeric_limits<double>::max();
        for (int i = 0; i < report.options.repeats(); ++i)
            least = std::min(least, run_program("keratin-diff", (folder / "before.kera") + " " +
                                                                    (folder / after) + " --quiet",
                                                code)
                                        .cpu_seconds);
        Row& row = report.rows.emplace_back();
        row.name = "diff: two assets of 100 000 strands, " + name;
        row.value = least;
        row.unit = "s";
        row.target = 1;
    };
    measure("equal", "before.kera", 0);
    bake("one", kStrands);
    measure("one strand moved", "one.kera", 1);
    bake("all", 1);
    measure("every strand moved", "all.kera", 1);
}

}  // namespace keratin::bench
