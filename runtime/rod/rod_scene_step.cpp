#include "runtime/rod/rod_scene_step.h"

#include "runtime/rod/double3.h"

#include <algorithm>
#include <limits>

namespace keratin {

namespace {

class Inverse final : public RodInverse {
  public:
    explicit Inverse(const RodSolver& solver) : s_(solver) {}
    std::uint64_t version(std::uint32_t b) const override { return s_.r.work[b]->version; }
    void apply_block(std::uint32_t b, std::size_t first, std::span<double> values) const override {
        const std::size_t lanes = s_.lanes, rows = values.size() / (3 * lanes);
        const std::uint8_t* free = s_.blocks.free_lanes.data() + s_.blocks.block_first[b] / lanes;
        const std::uint32_t used = s_.blocks.used_lanes(b);
        for (std::size_t r = first; r < rows; ++r) {
            if ((free[r] & used) == used) continue;
            for (std::size_t l = 0; l < lanes; ++l)
                for (std::size_t c = 0; c < 3 && !has(free[r], static_cast<std::uint32_t>(l)); ++c)
                    values[(3 * r + c) * lanes + l] = 0;
        }
        s_.passes.apply_inverse(first, rows, s_.r.work[b]->band_rows(s_.lanes), values.data());
    }
    std::size_t margin() const override { return 3 * kRodPadRows * s_.lanes; }

  private:
    const RodSolver& s_;
};

double mean_vertex_mass(const RodBlocks& blocks) {
    double sum = 0;
    std::size_t n = 0;
    for (std::size_t s = 0; s < blocks.vertex_count.size(); ++s)
        for (std::size_t i = 0; i < blocks.vertex_count[s]; ++i) {
            const std::size_t k = blocks.index(s, i, 0);
            if (blocks.inverse_mass[k] == 0) continue;
            sum += blocks.mass[k];
            ++n;
        }
    return n > 0 ? sum / static_cast<double>(n) : 0;
}

ContactProblem problem(const RodSolver& solver, const RodPart& part, double whole) {
    const RodStepper& r = solver.r;
    const RodBlocks& blocks = solver.blocks;
    ContactProblem p;
    p.layout = blocks.layout();
    p.time = r.time + part.s0 * whole;
    p.step = part.h;
    for (std::size_t c = 0; c < 3; ++c) p.origin[c] = blocks.origin[c];
    p.x_t0 = blocks.x.span();
    p.v_t0 = blocks.v.span();
    p.inverse_mass = blocks.inverse_mass.span();
    p.radius = blocks.radius;
    p.spin_weight = blocks.spin_weight;
    const double g = length(r.settings.gravity);
    p.gravity_speed = g > 0 ? part.h * g : 1e-2;
    p.mean_vertex_mass = mean_vertex_mass(blocks);
    return p;
}

// The velocities, of running strands with the direction added.
void gather_velocity(RodSolver& solver) {
    RodStepper& r = solver.r;
    const RodBlocks& blocks = solver.blocks;
    const auto count = static_cast<std::ptrdiff_t>(blocks.block_count());
#pragma omp parallel for num_threads(solver.threads()) schedule(static)
    for (std::ptrdiff_t b = 0; b < count; ++b) {
        RodWorkspace& w = *r.work[b];
        solver.passes.look_ahead(w.block, w.running, w.v.data(), w.direction_rows(solver.lanes),
                                 r.contact_v.data() + blocks.block_first[b]);
    }
}

// Algorithm 2 (METHODS §2.4) with the impulses inside the Newton iteration: they are found for
// the velocity that the whole Newton step leads to, and the step is taken with them. (Taken
// without them, it would base the next one on strands that have run into each other.)
enum class Outcome { open, overlapping, converged };
Outcome iterate_scene(RodSolver& solver, const ContactProblem& p, RodStepReport& report) {
    RodStepper& r = solver.r;
    const RodPasses& passes = solver.passes;
    const RodBlocks& blocks = solver.blocks;
    const std::uint32_t lanes = solver.lanes;
    // Contacts that the impulses cause are looked for every other time until there are none with
    // the velocities this near (in tolerances): geometry and impulses come to rest together, in a
    // third of the iterations that one after the other takes where hair lands on a head.
    constexpr double kNear = 1e3;
    // Impulses that the pass cannot bring under the law while the velocities stand still never
    // will be; after so many iterations this step is given up.
    constexpr std::uint32_t kIdle = 8;
    std::uint32_t idle = 0;
    bool look = true, quiet = false;
    std::uint32_t looked = 0;
    const auto count = static_cast<std::ptrdiff_t>(blocks.block_count());
    const Inverse inverse(solver);
    ContactPass pass;
    pass.mean_change = std::numeric_limits<double>::infinity();
    std::fill_n(r.impulse.data(), r.impulse.size(), 0.0);
    r.convergence.clear();
    for (std::uint32_t k = 0; k < r.settings.iterations; ++k) {
        double start = seconds_now();
        std::uint32_t running = 0, failed = 0;
#pragma omp parallel for num_threads(solver.threads()) schedule(dynamic) \
    reduction(|                                                          \
              : running, failed)
        for (std::ptrdiff_t b = 0; b < count; ++b) {
            RodWorkspace& w = *r.work[b];
            w.change.fill(0);
            if (w.running != 0) newton_direct(passes, w, solver.rules());
            running |= w.running;
            failed |= w.failed;
        }
        if (failed != 0) return Outcome::open;
        gather_velocity(solver);
        r.stats.dynamics += seconds_now() - start;
        const bool settled =
            k > 0 && running == 0 && !pass.stalled && !pass.unfinished &&
            (pass.contacts == 0 || pass.mean_change < r.settings.tolerance * p.mean_vertex_mass);
        idle = k > 0 && running == 0 && pass.stalled ? idle + 1 : 0;
        if (idle > kIdle) break;
        if (look || settled) {
            start = seconds_now();
            const std::size_t added = r.contact->detect(p, r.contact_v.span());
            r.stats.collision_detection += seconds_now() - start;
            looked = k;
            quiet = k > 0 && added == 0;
            if (settled && added == 0) {
                report.contacts = static_cast<std::uint32_t>(pass.contacts);
                report.mean_impulse_change = pass.contacts == 0 ? 0 : pass.mean_change;
                return r.contact->overlaps() ? Outcome::overlapping : Outcome::converged;
            }
        }
        start = seconds_now();
        std::swap(r.impulse, r.impulse_before);
        pass = r.contact->pass(p, r.contact_v.span(), inverse, r.impulse.span());
        r.stats.impulse_solve += seconds_now() - start;
        start = seconds_now();
        double change = 0;
#pragma omp parallel for num_threads(solver.threads()) schedule(dynamic) reduction(| : failed)
        for (std::ptrdiff_t b = 0; b < count; ++b) {
            RodWorkspace& w = *r.work[b];
            const std::size_t begin = blocks.block_first[b], end = blocks.block_first[b + 1];
            for (std::size_t i = begin; i < end; ++i)
                r.impulse_before[i] = r.impulse[i] - r.impulse_before[i];
            newton_push(passes, w, r.impulse_before.data() + begin);
            if (w.running == 0) continue;
            newton_redirect(passes, w);
            newton_take(passes, w, solver.rules());
            failed |= w.failed;
        }
        for (std::ptrdiff_t b = 0; b < count; ++b)
            for (std::uint32_t l = 0; l < lanes; ++l) change += r.work[b]->change[l];
        report.mean_change =
            change / static_cast<double>(std::max<std::size_t>(1, blocks.first.size()));
        r.convergence.push_back({report.mean_change, pass.mean_change});
        const bool nearer = report.mean_change < kNear * r.settings.tolerance;
        quiet = quiet && nearer;
        look = !quiet && k > looked;
        ++report.contact_iterations;
        r.stats.dynamics += seconds_now() - start;
        if (failed != 0) return Outcome::open;
    }
    report.contacts = static_cast<std::uint32_t>(pass.contacts);
    report.mean_impulse_change = pass.mean_change;
    return Outcome::open;
}

}  // namespace

void advance_scene(RodSolver& solver, const RodPart& part, double whole, std::uint32_t depth,
                   RodStepReport& report) {
    RodStepper& r = solver.r;
    const RodBlocks& blocks = solver.blocks;
    const auto count = static_cast<std::ptrdiff_t>(blocks.block_count());
    double start = seconds_now();
#pragma omp parallel for num_threads(solver.threads()) schedule(dynamic)
    for (std::ptrdiff_t b = 0; b < count; ++b)
        solver.begin(*r.work[b], b, blocks.used_lanes(b), part);
    r.stats.prepare += seconds_now() - start;
    const ContactProblem p = problem(solver, part, whole);
    r.contact->begin_step(p);
    const Outcome outcome = iterate_scene(solver, p, report);
    std::uint32_t failed = 0;
    for (std::ptrdiff_t b = 0; b < count; ++b) failed |= r.work[b]->failed;
    const RodSettings& settings = r.settings;
    const std::uint32_t limit = failed != 0                       ? settings.halvings
                                : outcome == Outcome::overlapping ? settings.overlap_halvings
                                                                  : settings.contact_halvings;
    if (outcome != Outcome::converged && depth < std::min(limit, r.settings.halvings)) {
        if (depth == 0) report.halved = static_cast<std::uint32_t>(blocks.first.size());
        const double middle = (part.s0 + part.s1) / 2;
        advance_scene(solver, {part.h / 2, part.s0, middle}, whole, depth + 1, report);
        advance_scene(solver, {part.h / 2, middle, part.s1}, whole, depth + 1, report);
        return;
    }
    if (outcome == Outcome::open) {
        report.at_cap = static_cast<std::uint32_t>(blocks.first.size());
        for (std::ptrdiff_t b = 0; b < count; ++b) r.work[b]->running = 0;
        gather_velocity(solver);
    }
    r.contact->end_step(p, r.contact_v.span());
    start = seconds_now();
    for (std::ptrdiff_t b = 0; b < count; ++b) solver.count(*r.work[b], r.work[b]->used, report);
#pragma omp parallel for num_threads(solver.threads()) schedule(dynamic)
    for (std::ptrdiff_t b = 0; b < count; ++b) solver.commit(*r.work[b], b, r.work[b]->used, part);
    r.stats.prepare += seconds_now() - start;
}

}  // namespace keratin
