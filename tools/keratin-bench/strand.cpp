// The strand solver against the targets of the README's table, and against a naive loop that goes
// strand by strand with the same maths.
#include "runtime/simulation.h"
#include "tools/keratin-bench/naive_strand.h"
#include "tools/keratin-bench/sections.h"
#include "tools/scenes/groom.h"

#ifdef KERATIN_WITH_BAKE
#include "tools/keratin-bench/programs.h"
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <utility>

namespace keratin::bench {

namespace {

constexpr std::uint32_t kIterations = 4;

scenes::Groom scene(std::uint32_t guides, std::uint32_t points, std::uint32_t strands_per_guide,
                    bool grid) {
    scenes::GroomOptions options;
    options.group.strand.iterations = kIterations;
    options.group.strand.damping = {0.05f};
    if (grid) options.group.strand.friction = {0.1f}, options.group.strand.volume = {0.1f};
    return scenes::thick_groom(guides, points, strands_per_guide, options);
}

void add_body(Settings& settings) {
    for (const BodyCapsule& c : kBody)
        settings.colliders.push_back({CapsuleCollider{c.a, c.b, c.radius}, kBodyFriction});
}

// Shakes the head so that nothing sleeps or stands still.
struct Shaker {
    Simulation* simulation;
    bool body = true;  // its first collider is the head
    int frame = 0;

    void step() {
        const double t = ++frame / 60.0, yaw = 0.35 * std::sin(6.283185307 * t);
        const RigidTransform head{{0.05 * std::sin(6.283185307 * t), 0, 0},
                                  {0, std::sin(yaw / 2), 0, std::cos(yaw / 2)}};
        (void)simulation->set_motion(head);
        if (body) (void)simulation->set_collider(0, head);
        (void)simulation->step(1.0 / 60);
    }
};

std::string count_name(std::uint32_t n) {
    return n % 1000 == 0 ? std::to_string(n / 1000) + "k" : std::to_string(n);
}

std::vector<int> thread_counts(const Options& options) {
    if (options.threads > 0) return {options.threads};
    return {1, 2};
}

void constraints(Report& report) {
    struct Size {
        std::uint32_t guides;
        double target;
    };
    for (const Size& size : {Size{1024, 1.35}, Size{10240, 1.6}, Size{51200, 1.9}}) {
        if (report.options.quick && size.guides > 2000) continue;
        const std::string label =
            "constraints, " + count_name(size.guides / 1024 * 1000) + " guides x 16, K = 4";
        const scenes::Groom groom = scene(size.guides, 16, 1, false);
        const double work = double(size.guides) * 16 * kIterations;
        double naive = 0;
        if (size.guides <= 2000) {
            NaiveStrands reference(groom, kIterations);
            naive =
                best_of(report.options, 1, [&] { reference.step(1.0 / 60); }).seconds / work * 1e9;
            report.rows.push_back({"naive strand-by-strand loop, " +
                                       count_name(size.guides / 1024 * 1000) + " guides x 16",
                                   naive,
                                   "ns/point/iteration",
                                   60.0,
                                   true,
                                   true,
                                   {},
                                   1,
                                   {}});
        }
        double one = 0;
        for (int threads : thread_counts(report.options)) {
            Settings settings;
            settings.threads = threads;
            settings.lod = 0;
            add_body(settings);
            auto s = Simulation::create(groom.info, groom.fields, settings);
            Shaker shaker{&*s};
            for (int i = 0; i < 20; ++i) shaker.step();
            const Timing t = best_of(report.options, threads, [&] { shaker.step(); });
            const double ns = t.seconds / work * 1e9;
            Row row{label, ns, "ns/point/iteration", {}, true, true, {}, threads, t.utilisation};
            if (threads == 1) {
                one = ns;
                row.target = size.target;
            }
            if (naive > 0) row.ratio_to_reference = naive / ns;
            report.rows.push_back(row);
            if (naive > 0)
                report.rows.push_back({label + ": times faster than naive", naive / ns, "x",
                                       threads == 1 ? 25.0 : 45.0, false, false, naive / ns,
                                       threads, t.utilisation});
            if (threads == 2 && one > 0)
                report.rows.push_back({label + ": two threads over one",
                                       ns / one,
                                       "x",
                                       0.55,
                                       true,
                                       false,
                                       {},
                                       2,
                                       t.utilisation});
            if (threads == 1 && naive > 0) {
                const double gflops = kOperationsPerPoint / ns;
                report.rows.push_back({label + ": share of the multiply-add peak",
                                       100 * gflops / report.machine.fma_gflops,
                                       "%",
                                       45.0,
                                       false,
                                       false,
                                       {},
                                       1,
                                       {}});
            }
        }
    }
}

// The same loop with the instruction sets that this processor has but would not choose.
void narrower_sets(Report& report) {
    const scenes::Groom groom = scene(1024, 16, 1, false);
    for (const auto& [set, name] : {std::pair{InstructionSet::avx2, "AVX2"},
                                    std::pair{InstructionSet::baseline, "baseline"}}) {
        const InstructionSet widest = usable_instruction_set(InstructionSet::automatic);
        if (set >= widest || usable_instruction_set(set) != set) continue;
        Settings settings;
        settings.threads = 1;
        settings.lod = 0;
        settings.instruction_set = set;
        add_body(settings);
        auto s = Simulation::create(groom.info, groom.fields, settings);
        Shaker shaker{&*s};
        for (int i = 0; i < 20; ++i) shaker.step();
        const Timing t = best_of(report.options, 1, [&] { shaker.step(); });
        Row& row = report.rows.emplace_back();
        row.name = std::string("constraints, 1k guides x 16, K = 4, ") + name;
        row.value = t.seconds / (1024.0 * 16 * kIterations) * 1e9;
        row.unit = "ns/point/iteration";
        if (set == InstructionSet::avx2) row.target = 3.2;
        row.absolute = true;
    }
}

// The demo's ponytail head as it is baked: its own parameters, colliders and render strands.
void demo_frame(Report& report) {
#ifdef KERATIN_WITH_BAKE
    const Scratch folder;
    const std::string file = folder / "head.kera";
    run_program("keratin-bake", KERATIN_DATA_DIR "/ponytail/head.json -o " + file);
    const auto asset = AssetView::open(file);
    if (!asset) throw std::runtime_error(to_string(asset.error()));
    for (int threads : thread_counts(report.options)) {
        Settings settings;
        settings.threads = threads;
        auto s = Simulation::create(*asset, settings);
        if (!s) throw std::runtime_error(to_string(s.error()));
        Shaker shaker{&*s, false};
        for (int i = 0; i < 20; ++i) shaker.step();
        const Timing t = best_of(report.options, threads, [&] { shaker.step(); });
        Row& row = report.rows.emplace_back();
        row.name = "frame of the demo head, " + std::to_string(asset->info().guide_count) +
                   " guides, " + std::to_string(asset->info().strand_count) + " render strands";
        row.value = t.seconds * 1e3;
        row.unit = "ms";
        row.absolute = true;
        row.threads = threads;
        row.utilisation = t.utilisation;
    }
#else
    (void)report;
    std::fprintf(stderr, "the demo head's frame is left out: built without keratin-bake\n");
#endif
}

void frames(Report& report) {
    struct Case {
        std::uint32_t guides, points, grid;
        double one, two;
    };
    for (const Case& c : {Case{1000, 16, 32, 0.35, 0.25}, Case{10000, 16, 48, 4.0, 2.1},
                          Case{50000, 32, 64, 34, 18}}) {
        if (report.options.quick && c.guides > 2000) continue;
        const scenes::Groom groom = scene(c.guides, c.points, 10, true);
        for (int threads : thread_counts(report.options)) {
            Settings settings;
            settings.threads = threads;
            settings.grid_resolution = c.grid;
            settings.output = OutputPrecision::float16;
            add_body(settings);
            auto s = Simulation::create(groom.info, groom.fields, settings);
            Shaker shaker{&*s};
            for (int i = 0; i < 10; ++i) shaker.step();
            s->reset_stats();
            const Timing t = best_of(report.options, threads, [&] { shaker.step(); });
            const std::string label =
                "frame, " + count_name(c.guides) + " x " + std::to_string(c.points) + ", grid " +
                std::to_string(c.grid) + ", " + count_name(c.guides * 10) + " render strands";
            Row row{label, t.seconds * 1e3, "ms", {}, true, true, {}, threads, t.utilisation};
            if (threads <= 2) row.target = threads == 1 ? c.one : c.two;
            report.rows.push_back(row);
            const Stats stats = s->stats();
            if (threads == 1)
                for (const PassTime& p : stats.passes)
                    report.rows.push_back({"  mean of " + std::string(name_of(p.pass)),
                                           p.seconds / double(stats.health.steps) * 1e3,
                                           "ms wall",
                                           {},
                                           true,
                                           true,
                                           {},
                                           1,
                                           {}});
        }
    }
}

void memory(Report& report) {
    const scenes::Groom groom = scene(10240, 16, 1, false);
    Settings settings;
    settings.lod = 0;
    auto plan = make_plan(groom.info, groom.fields, settings);
    const double points = double(groom.info.row_count) * kTileLanes;
    const double rest =
        double(plan->bytes(BufferId::rest_edge)) + 4.0 * double(groom.guide_length.size());
    const double state = double(plan->bytes(BufferId::position) + plan->bytes(BufferId::previous) +
                                plan->bytes(BufferId::root) + plan->bytes(BufferId::quad_state));
    const double of_points =
        double(plan->bytes(BufferId::position) + plan->bytes(BufferId::previous));
    report.rows.push_back({"memory of a guide point, state and rest, 10k x 16",
                           (of_points + rest) / points,
                           "bytes",
                           40.0,
                           true,
                           false,
                           {},
                           1,
                           {}});
    report.rows.push_back({"the same with what its strand and quad keep",
                           (state + rest) / points,
                           "bytes",
                           {},
                           true,
                           false,
                           {},
                           1,
                           {}});
}

}  // namespace

void strand_section(Report& report) {
    constraints(report);
    narrower_sets(report);
    frames(report);
    demo_frame(report);
    memory(report);
}

}  // namespace keratin::bench
