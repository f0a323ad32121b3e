// Speed of contact: search, Gauss-Seidel sweeps, and whole steps of the hairball in its turning
// phase.
#include "runtime/contact/detection.h"
#include "runtime/contact/gauss_seidel.h"
#include "tools/keratin-bench/sections.h"
#include "tools/scenes/contact_scenes.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <stdexcept>

namespace keratin::bench {

namespace {

// Curly hair on a sphere: strands of 40 edges, each vertex on its way by about a millimetre.
struct Hair {
    std::vector<Vector3> x_t0, x_t1;
    std::vector<std::uint32_t> first_vertex, strand;
    std::vector<double> radius;
    std::vector<std::uint8_t> prescribed;

    explicit Hair(std::size_t edges) {
        constexpr std::uint32_t kEdges = 40;
        constexpr double kLength = 5e-3, kRadius = 5e-5;
        std::mt19937_64 random(7);
        std::normal_distribution<double> normal;
        auto any = [&] { return Vector3(normal(random), normal(random), normal(random)); };
        for (std::uint32_t s = 0; s < edges / kEdges; ++s) {
            Vector3 along = any();
            along *= 1 / length(along);
            Vector3 x = 0.15 * along;
            const Vector3 move = 1e-3 * any();
            for (std::uint32_t i = 0; i <= kEdges; ++i) {
                if (i < kEdges) {
                    first_vertex.push_back(static_cast<std::uint32_t>(x_t0.size()));
                    strand.push_back(s);
                    radius.push_back(kRadius);
                }
                x_t0.push_back(x);
                x_t1.push_back(x + move + 1e-4 * any());
                prescribed.push_back(i == 0);
                along += 0.2 * any();
                along *= 1 / length(along);
                x += kLength * along;
            }
        }
    }
    ContactStrands view() const { return {x_t0, x_t1, first_vertex, strand, radius, prescribed}; }
};

void search_rows(Report& report) {
    struct Size {
        std::size_t edges;
        const char* name;
        double target;  // ms
    };
    for (const Size& size :
         {Size{10'000, "10k", 1.2}, Size{100'000, "100k", 20}, Size{1'000'000, "1M", 380}}) {
        if (report.options.quick && size.edges > 100'000) break;
        const Hair hair(size.edges);
        Detection detection;
        DetectionSettings settings;
        std::size_t found = 0;
        const Timing time = best_of(
            report.options, 1, [&] { found = detection.find(hair.view(), {}, settings).size(); });
        Row row;
        row.name = std::string("broad and narrow phase, ") + size.name + " edges, " +
                   std::to_string(found) + " contacts";
        row.value = 1e3 * time.seconds;
        row.unit = "ms";
        row.target = size.target;
        row.absolute = true;
        report.rows.push_back(row);
    }
}

// Stands for the banded solves of 1 000 strands of 40 vertices: what a number feels of another
// falls off along the strand.
class FallingOff final : public RodInverse {
  public:
    FallingOff() {
        for (std::uint32_t s = 0; s < kStrands; ++s) {
            first_.push_back(s * kNumbers);
            count_.push_back(kVertices);
            block_.push_back(s);
            block_first_.push_back(s * kNumbers);
        }
        block_first_.push_back(kStrands * kNumbers);
    }
    RodLayout layout() const { return {first_, count_, block_, block_first_, 1}; }
    std::uint64_t version(std::uint32_t) const override { return 1; }
    void apply_block(std::uint32_t, std::size_t first, std::span<double> x) const override {
        // (1 - a S)^-1 (1 - a S^T)^-1 with S the shift by a vertex: two sweeps
        constexpr double kKept = 0.7;
        constexpr std::size_t kVertex = 3 * 4;  // three vectors
        for (std::size_t i = kVertex; i < x.size(); ++i) x[i] += kKept * x[i - kVertex];
        for (std::size_t i = x.size() - kVertex; i-- > 3 * first;) x[i] += kKept * x[i + kVertex];
    }

    static constexpr std::uint32_t kStrands = 1000, kVertices = 40, kNumbers = 4 * kVertices;

  private:
    std::vector<std::uint32_t> first_, count_, block_, block_first_;
};

void sweep_row(Report& report) {
    constexpr std::size_t kContacts = 5500;
    constexpr std::uint32_t kFew = 8, kMany = 40;
    const FallingOff inverse;
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    std::vector<ContactLaw> laws(kContacts);
    std::vector<SidePlace> places;
    const RodLayout layout = inverse.layout();
    std::vector<double> v(layout.number_count());
    for (double& x : v) x = normal(random);
    for (ContactLaw& law : laws) {
        law.sides = 2;
        law.friction = 0.3;
        for (std::uint32_t side = 0; side < 2; ++side) {
            const SidePlace place{
                static_cast<std::uint32_t>(random() % FallingOff::kStrands),
                static_cast<std::uint32_t>(random() % (FallingOff::kVertices - 1))};
            law.rows[side].first =
                static_cast<std::uint32_t>(layout.index(place.strand, place.vertex, 0));
            const double along = static_cast<double>(random() >> 11) * 0x1p-53;
            for (int k = 0; k < 3; ++k) {
                law.rows[side].weight[k][k] = (1 - along) * (side == 0 ? 1 : -1);
                law.rows[side].weight[k][4 + k] = along * (side == 0 ? 1 : -1);
            }
            places.push_back(place);
        }
    }
    GaussSeidel solver;
    solver.assemble(layout, laws, places, inverse, 1);
    const std::vector<double> none(3 * kContacts, 0.0);
    auto seconds = [&](std::uint32_t sweeps) {
        GaussSeidelSettings settings;
        settings.accepted = settings.residual = 0;
        settings.most_sweeps = sweeps;
        settings.velocity_scale = settings.impulse_scale = 1;
        std::vector<double> impulses;
        return best_of(report.options, 1,
                       [&] {
                           impulses = none;
                           solver.solve(laws, v, none, settings, impulses);
                       })
            .seconds;
    };
    Row row;
    row.name = "Gauss-Seidel, 5500 contacts of 1000 strands x 40 vertices";
    row.value = 1e9 * (seconds(kMany) - seconds(kFew)) / ((kMany - kFew) * kContacts);
    row.unit = "ns/contact/sweep";
    row.target = 60;
    row.absolute = true;
    report.rows.push_back(row);
}

double process_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// A scene with its contact, stepped.
struct Run {
    scenes::ContactScene scene;
    RodSimulation rods;
    StrandContact contact;
    std::uint64_t steps = 0;

    static RodSimulation create(const scenes::ContactScene& scene) {
        auto rods = RodSimulation::create(scene.strands, scene.rod);
        if (!rods) throw std::runtime_error(to_string(rods.error()));
        return std::move(*rods);
    }
    explicit Run(const scenes::ContactScene& s)
        : scene(s), rods(create(scene)), contact(scene.contact, scene.colliders) {
        rods.attach_contact(&contact);
    }
    RodStepReport step() {
        ++steps;
        if (scene.drive) scene.drive(rods, static_cast<double>(steps) * scene.step, scene.step);
        return *rods.step(scene.step);
    }
    // Where another run of the scene is.
    void go_to(const Run& other) {
        (void)rods.restore(other.rods.save());
        (void)contact.restore(other.contact.save());
        steps = other.steps;
    }
};

struct Steps {
    double seconds = 0, residual = 0, contacts = 0, iterations = 0;  // means over the steps
    double at_cap = 0;                                               // share
    double part[5] = {};  // s: prepare, dynamics, detection, bookkeeping, solve
};
Steps take(Run& run, std::uint64_t count) {
    Steps out;
    run.rods.reset_stats();
    run.contact.reset_totals();
    const double start = process_seconds();
    for (std::uint64_t k = 0; k < count; ++k) {
        const RodStepReport step = run.step();
        out.iterations += step.contact_iterations;
        out.at_cap += step.at_cap > 0;
    }
    const double n = static_cast<double>(count);
    out.seconds = (process_seconds() - start) / n;
    out.iterations /= n;
    out.at_cap /= n;
    const ContactTotals& totals = run.contact.totals();
    const double taken = std::max(1.0, static_cast<double>(totals.steps));
    out.residual = totals.residual_sum / taken;
    out.contacts = static_cast<double>(totals.contacts) / taken;
    const RodStats& stats = run.rods.stats();
    const double parts[5] = {stats.prepare, stats.dynamics, totals.detection_seconds,
                             totals.bookkeeping_seconds, totals.solve_seconds};
    for (int i = 0; i < 5; ++i) out.part[i] = parts[i] / n;
    return out;
}

void add_row(Report& report, const std::string& name, double value, const char* unit, int threads,
             std::optional<double> target = {}) {
    Row row;
    row.name = name;
    row.value = value;
    row.unit = unit;
    row.threads = threads;
    row.target = target;
    row.absolute = row.unit == "ms";
    report.rows.push_back(row);
}

// Time against error: both methods go on from the same state, with ever more iterations a step.
void compare_methods(Report& report, const scenes::ContactScene& scene, const Run& from,
                     std::uint64_t steps) {
    struct Way {
        ContactMethod method;
        std::uint32_t iterations, sweeps;
        const char* name;
    };
    const Way ways[] = {{ContactMethod::impulse, 20, 0, "impulse, 20 iterations"},
                        {ContactMethod::impulse, 50, 0, "impulse, 50 iterations"},
                        {ContactMethod::impulse, 200, 0, "impulse, 200 iterations"},
                        {ContactMethod::gauss_seidel, 5, 50, "gauss_seidel, 5 iterations"},
                        {ContactMethod::gauss_seidel, 20, 200, "gauss_seidel, 20 iterations"},
                        {ContactMethod::gauss_seidel, 50, 200, "gauss_seidel, 50 iterations"}};
    for (const Way& way : ways) {
        scenes::ContactScene s = scene;
        s.contact.method = way.method;
        if (way.sweeps > 0) s.contact.most_sweeps = way.sweeps;
        s.rod.iterations = way.iterations;
        s.rod.contact_halvings = s.rod.overlap_halvings = 0;
        s.rod.threads = s.contact.threads = 1;
        Run run(s);
        run.go_to(from);
        const Steps done = take(run, steps);
        const std::string name = s.name + ", " + way.name;
        add_row(report, name, 1e3 * done.seconds, "ms", 1);
        add_row(report, name + ": mean |f_FB|", done.residual, "", 1);
        add_row(report, name + ": share of steps at the cap", done.at_cap, "", 1);
    }
}

}  // namespace

void contact_section(Report& report) {
    search_rows(report);
    sweep_row(report);
}

void contact_methods_section(Report& report) {
    // Small bundles at the moment when they hold each other.
    struct Case {
        scenes::ContactScene scene;
        std::uint64_t start;
    };
    const bool quick = report.options.quick;
    for (const Case& c : {Case{scenes::bundle_on_bundle(quick ? 7 : 19), 60},
                          Case{scenes::bundle_on_cylinder(quick ? 7 : 37), 60},
                          Case{scenes::bundle_on_ground(quick ? 7 : 19), 55}}) {
        Run from(c.scene);
        for (std::uint64_t k = 0; k < c.start; ++k) (void)from.step();
        compare_methods(report, c.scene, from, 10);
    }
}

void hairball_section(Report& report) {
    constexpr double kTurning = 1.0;  // s
    constexpr std::uint64_t kSteps = 20;
    scenes::HairballOptions options;
    if (report.options.quick) options.strands = 100;
    const scenes::ContactScene scene = scenes::hairball(options);
    // The landing on the way there may be coarse: it is long past by then.
    scenes::ContactScene way = scene;
    way.rod.contact_halvings = way.rod.overlap_halvings = 1;
    Run from(way);
    while (static_cast<double>(from.steps) * scene.step < kTurning - 1e-9) (void)from.step();
    for (const int threads : {1, 2}) {
        if (report.options.threads > 0 && threads != report.options.threads) continue;
        scenes::ContactScene s = scene;
        s.rod.threads = s.contact.threads = threads;
        Run run(s);
        run.go_to(from);
        const Steps done = take(run, kSteps);
        const std::string name = "hairball, turning phase";
        const bool whole = !report.options.quick && threads == 2;
        add_row(report, name, 1e3 * done.seconds / threads, "ms", threads,
                whole ? std::optional(60.0) : std::nullopt);
        const char* parts[5] = {"prepare", "dynamics", "collision detection", "contact bookkeeping",
                                "impulse solve"};
        double sum = 0;
        for (const double p : done.part) sum += p;
        for (int i = 0; i < 5; ++i)
            add_row(report, name + ": " + parts[i], 100 * done.part[i] / sum, "% of wall time",
                    threads);
        add_row(report, name + ": contacts", done.contacts, "", threads);
        add_row(report, name + ": iterations", done.iterations, "", threads);
        add_row(report, name + ": mean |f_FB|", done.residual, "", threads);
        add_row(report, name + ": share of steps at the cap", done.at_cap, "", threads);
    }
    compare_methods(report, scene, from, 5);
}

}  // namespace keratin::bench
