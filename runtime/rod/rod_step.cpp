#include "runtime/rod/rod_step.h"

#include "runtime/rod/rod_scene_step.h"
#include "runtime/rod/rod_solver.h"

#include <algorithm>
#include <bit>
#include <omp.h>

namespace keratin {

namespace {

// What Newton's method is asked for: the whole part, or with the midpoint rule its first half.
RodPart solved(const RodSolver& solver, const RodPart& part) {
    if (solver.r.settings.integrator == RodIntegrator::euler) return part;
    return {part.h / 2, part.s0, (part.s0 + part.s1) / 2};
}

// Solves the part of the step for the lanes in `mask`, in halves where it does not converge.
void advance(RodSolver& solver, RodWorkspace& w, std::size_t b, std::uint32_t mask,
             const RodPart& part, std::uint32_t depth, RodStepReport& report) {
    solver.begin(w, b, mask, solved(solver, part));
    for (std::uint32_t k = 0; k < solver.r.settings.iterations && w.running != 0; ++k)
        newton_iterate(solver.passes, w, solver.rules());
    solver.count(w, mask, report);
    const std::uint32_t open = (w.running | w.failed) & mask;
    const bool last = depth >= solver.r.settings.halvings;
    solver.commit(w, b, last ? mask : mask & ~open, part);
    if (open == 0) return;
    if (last) {
        report.at_cap += static_cast<std::uint32_t>(std::popcount(open));
        return;
    }
    if (depth == 0) report.halved += static_cast<std::uint32_t>(std::popcount(open));
    const double middle = (part.s0 + part.s1) / 2;
    advance(solver, w, b, open, {part.h / 2, part.s0, middle}, depth + 1, report);
    advance(solver, w, b, open, {part.h / 2, middle, part.s1}, depth + 1, report);
}

void advance_block(RodSolver& solver, RodWorkspace& w, std::size_t b, double h,
                   RodStepReport& report) {
    std::uint32_t left = solver.blocks.used_lanes(b);
    w.lost = 0;
    while (left != 0) {
        const auto first = static_cast<std::uint32_t>(std::countr_zero(left));
        const std::uint32_t n =
            solver.pieces(solver.blocks.strand_of_lane[b * solver.lanes + first]);
        std::uint32_t mask = 0;
        for (std::uint32_t l = 0; l < solver.lanes; ++l)
            if (has(left, l) &&
                solver.pieces(solver.blocks.strand_of_lane[b * solver.lanes + l]) == n)
                mask |= 1u << l;
        for (std::uint32_t k = 0; k < n; ++k)
            advance(solver, w, b, mask, {h / n, double(k) / n, double(k + 1) / n}, 0, report);
        left &= ~mask;
    }
    report.lost += static_cast<std::uint32_t>(std::popcount(w.lost));
}

}  // namespace

int thread_count(const RodSettings& settings) {
    return settings.threads > 0 ? settings.threads : omp_get_max_threads();
}

void lay_out_work(RodStepper& r) {
    RodBlocks& b = r.blocks;
    std::size_t longest = 0;
    for (std::size_t k = 0; k < b.block_count(); ++k) longest = std::max(longest, b.rows(k));
    r.work.clear();
    if (r.contact != nullptr) {
        r.contact->attached();
        for (std::size_t k = 0; k < b.block_count(); ++k)
            r.work.push_back(std::make_unique<RodWorkspace>(b.rows(k), b.lanes));
    } else
        for (int k = 0; k < thread_count(r.settings); ++k)
            r.work.push_back(std::make_unique<RodWorkspace>(longest, b.lanes));
    const std::size_t numbers = r.contact != nullptr ? b.x.size() : 0;
    r.contact_v = AlignedDoubles(numbers);
    r.impulse = AlignedDoubles(numbers);
    r.impulse_before = AlignedDoubles(numbers);
    r.convergence.reserve(r.settings.iterations);
    r.block_report.resize(b.block_count());
}

RodStepReport take_step(RodStepper& r, double h) {
    RodSolver solver(r);
    RodStepReport report;
    const auto count = static_cast<std::ptrdiff_t>(r.blocks.block_count());
    if (r.contact != nullptr) {
        std::uint32_t n = 1;
        for (std::size_t s = 0; s < r.blocks.shapes.size(); ++s) n = std::max(n, solver.pieces(s));
        for (auto& w : r.work) w->lost = 0;
        for (std::uint32_t k = 0; k < n; ++k)
            advance_scene(solver, {h / n, double(k) / n, double(k + 1) / n}, h, 0, report);
        for (const auto& w : r.work)
            report.lost += static_cast<std::uint32_t>(std::popcount(w->lost));
    } else {
        const double start = seconds_now();
#pragma omp parallel for num_threads(solver.threads()) schedule(dynamic)
        for (std::ptrdiff_t b = 0; b < count; ++b) {
            r.block_report[b] = {};
            advance_block(solver, *r.work[omp_get_thread_num()], b, h, r.block_report[b]);
        }
        for (const RodStepReport& part : r.block_report) {
            report.iterations += part.iterations;
            report.most_iterations = std::max(report.most_iterations, part.most_iterations);
            report.halved += part.halved;
            report.at_cap += part.at_cap;
            report.indefinite += part.indefinite;
            report.lost += part.lost;
            report.mean_change += part.mean_change;
        }
        report.mean_change /= static_cast<double>(std::max<std::size_t>(1, r.blocks.first.size()));
        r.stats.dynamics += seconds_now() - start;
    }
    solver.arrive();
    r.time += h;
    ++r.stats.steps;
    r.stats.strand_iterations += report.iterations;
    r.stats.steps_at_cap += report.at_cap > 0;
    r.stats.steps_halved += report.halved > 0;
    return report;
}

}  // namespace keratin
