#include "runtime/rod/rod_newton.h"

#include <algorithm>
#include <cmath>

namespace keratin {

namespace {

// Algorithm 1: a step is long enough short when g falls by this share of the slope.
constexpr double kDescent = 1e-4;
// Differences of g below this share of the sum of its terms' sizes may be rounding (of the positions,
// enlarged by the stiffness): the slope decides then.
constexpr double kRounding = 1e-10;
// A strand that no longer improves is at rest in rounding if Newton's method promises no more than this
// share of the terms' sizes, and has failed otherwise.
constexpr double kLevel = 1e-9;
// A Newton step that moves a strand by less than this share of its size is below rounding.
constexpr double kResolution = 1e-15;
// Backtracking ends here; 1e-9 of a Newton step gets nowhere.
constexpr double kShortest = 1e-9;
// The factor is renewed when an iteration leaves more than this share of the last change.
constexpr double kStall = 0.35;

void evaluate(const RodPasses& passes, RodWorkspace& w) {
    passes.evaluate(w.block, w.v.data(), w.direction_rows(passes.lanes), w.alpha.data(),
                    w.frames.data(), w.v_try.data(), w.frames_try.data(), w.gradient_try.data(),
                    w.energy_try.data(), w.scale_try.data(), w.slope_try.data());
}

// v_try and all that belongs to it become the state of the lanes in `mask`.
void accept(const RodPasses& passes, RodWorkspace& w, std::uint32_t mask) {
    if (mask == 0) return;
    if ((mask & w.used) == w.used) {
        std::swap(w.v, w.v_try);
        std::swap(w.gradient, w.gradient_try);
        std::swap(w.frames, w.frames_try);
    } else {
        const std::size_t rows = w.block.vertex_count;
        passes.keep(4 * rows, mask, w.v_try.data(), w.v.data());
        passes.keep(4 * rows, mask, w.gradient_try.data(), w.gradient.data());
        passes.keep(kRodFrame * rows, mask, w.frames_try.data(), w.frames.data());
    }
    for (std::uint32_t l = 0; l < passes.lanes; ++l)
        if (has(mask, l)) {
            w.energy[l] = w.energy_try[l];
            w.scale[l] = w.scale_try[l];
        }
}

// Sets w.band in the lanes that ask for it. A Hessian that is not positive definite is replaced by the
// one without second derivatives, which is.
void renew_factor(const RodPasses& passes, RodWorkspace& w, std::uint32_t lanes) {
    const std::size_t rows = 4 * static_cast<std::size_t>(w.block.vertex_count);
    double* fresh = w.band_new.data() + kRodPadRows * kRodBandWidth * passes.lanes;
    std::fill_n(w.exact.data(), passes.lanes, 1.0);
    passes.assemble(w.block, w.v.data(), w.frames.data(), w.exact.data(), fresh);
    std::uint32_t bad = passes.factor(rows, fresh) & lanes;
    if (bad != 0) {
        w.indefinite |= bad;
        for (std::uint32_t l = 0; l < passes.lanes; ++l)
            if (has(bad, l)) w.exact[l] = 0;
        passes.assemble(w.block, w.v.data(), w.frames.data(), w.exact.data(), fresh);
        bad = passes.factor(rows, fresh) & lanes;
        w.failed |= bad;
        w.running &= ~bad;
    }
    if ((lanes & w.used) == w.used)
        std::swap(w.band, w.band_new);
    else
        passes.keep(rows * kRodBandWidth, lanes, fresh, w.band_rows(passes.lanes));
    w.factored |= lanes;
    w.fresh |= lanes;
    ++w.version;
}

}  // namespace

RodWorkspace::RodWorkspace(std::size_t rows, std::uint32_t lanes)
    : v(4 * rows * lanes),
      v_try(4 * rows * lanes),
      gradient(4 * rows * lanes),
      gradient_try(4 * rows * lanes),
      weight(4 * rows * lanes),
      target(4 * rows * lanes),
      direction((4 * rows + 2 * kRodPadRows) * lanes),
      frames(kRodFrame * rows * lanes),
      frames_try(kRodFrame * rows * lanes),
      edges(kRodEdge * rows * lanes),
      joints(kRodJoint * rows * lanes),
      ends(12 * lanes),
      strains(kRodStrain * rows * lanes),
      band((4 * rows + 2 * kRodPadRows) * kRodBandWidth * lanes),
      band_new((4 * rows + 2 * kRodPadRows) * kRodBandWidth * lanes) {
    for (AlignedDoubles* a : {&alpha, &energy, &scale, &slope, &energy_try, &scale_try, &slope_try,
                              &norm, &down, &exact, &reach})
        *a = AlignedDoubles(lanes);
}

void newton_begin(const RodPasses& passes, RodWorkspace& w, std::uint32_t lanes) {
    std::fill_n(w.alpha.data(), passes.lanes, 0.0);
    std::fill_n(w.direction.data(), w.direction.size(), 0.0);
    // a longer block may have left its rows where this one's pad rows are
    const std::size_t after =
        (kRodPadRows + 4 * static_cast<std::size_t>(w.block.vertex_count)) * kRodBandWidth * passes.lanes;
    for (AlignedDoubles* band : {&w.band, &w.band_new})
        std::fill_n(band->data() + after, kRodPadRows * kRodBandWidth * passes.lanes, 0.0);
    w.running = lanes;
    w.refactor = lanes;
    w.fresh = w.failed = w.indefinite = w.factored = 0;
    w.iterations.fill(0);
    w.change.fill(0);
    w.last_change.fill(HUGE_VAL);
    evaluate(passes, w);
    accept(passes, w, w.used);
}

void newton_offer(const RodPasses& passes, RodWorkspace& w, std::uint32_t lanes) {
    for (std::uint32_t l = 0; l < passes.lanes; ++l) w.alpha[l] = has(lanes, l) ? 1 : 0;
    evaluate(passes, w);
    std::uint32_t better = 0;
    for (std::uint32_t l = 0; l < passes.lanes; ++l)
        if (has(lanes, l) && w.energy_try[l] < w.energy[l]) better |= 1u << l;
    accept(passes, w, better);
    std::fill_n(w.direction.data(), w.direction.size(), 0.0);
}

void newton_iterate(const RodPasses& passes, RodWorkspace& w, const NewtonRules& rules) {
    newton_direct(passes, w, rules);
    newton_take(passes, w, rules);
}

void newton_direct(const RodPasses& passes, RodWorkspace& w, const NewtonRules& rules) {
    const std::uint32_t renew =
        (rules.kind == RodNewton::full ? w.running : w.refactor & w.running) & ~w.fresh;
    if (renew != 0) renew_factor(passes, w, renew);
    w.refactor = 0;
    newton_redirect(passes, w);
}

void newton_redirect(const RodPasses& passes, RodWorkspace& w) {
    passes.solve(w.block, w.band_rows(passes.lanes), w.gradient.data(),
                 w.direction_rows(passes.lanes), w.norm.data(), w.down.data());
}

void newton_take(const RodPasses& passes, RodWorkspace& w, const NewtonRules& rules) {
    std::uint32_t pending = w.running, stuck = 0, still = 0;
    for (std::uint32_t l = 0; l < passes.lanes; ++l) {
        w.alpha[l] = has(pending, l) ? 1 : 0;
        if (!has(pending, l)) continue;
        ++w.iterations[l];
        w.change[l] = std::sqrt(w.norm[l]) / w.dimension[l];
        if (!(w.down[l] <= 0) || !std::isfinite(w.norm[l])) {
            pending &= ~(1u << l);
            stuck |= 1u << l;
            w.alpha[l] = 0;
        } else if (w.block.step * std::sqrt(w.norm[l]) <= kResolution * w.reach[l]) {
            pending &= ~(1u << l);
            still |= 1u << l;
            w.alpha[l] = 0;
        }
    }
    w.running &= ~still;
    std::uint32_t taken = 0;
    while (pending != 0) {
        evaluate(passes, w);
        for (std::uint32_t l = 0; l < passes.lanes; ++l) {
            if (!has(pending, l)) continue;
            const double rise = w.energy_try[l] - w.energy[l], slope = w.down[l];
            const double noise = kRounding * std::max(w.scale[l], w.scale_try[l]);
            const bool falls = rise <= kDescent * w.alpha[l] * slope;
            const bool settles = -slope <= noise && rise <= noise &&
                                 std::fabs(w.slope_try[l]) <= 0.9 * std::fabs(slope);
            if (falls || settles) {
                pending &= ~(1u << l);
                taken |= 1u << l;
                continue;
            }
            // the parabola through g(0), g'(0), g(alpha) has its least value here
            const double curve = rise - w.alpha[l] * slope;
            const double guess = curve > 0 ? -slope * w.alpha[l] * w.alpha[l] / (2 * curve) : 0;
            w.alpha[l] = std::isfinite(rise)
                             ? std::clamp(guess, 0.1 * w.alpha[l], 0.5 * w.alpha[l])
                             : 0.1 * w.alpha[l];
            if (w.alpha[l] < kShortest) {
                pending &= ~(1u << l);
                stuck |= 1u << l;
                w.alpha[l] = 0;
            }
        }
    }
    const std::uint32_t was_fresh = w.fresh;
    accept(passes, w, taken);
    w.fresh &= ~taken;
    for (std::uint32_t l = 0; l < passes.lanes; ++l) {
        if (has(stuck, l)) {
            // no way down with the factor at hand: a new one, and if that was new, g is as low as
            // rounding lets it come, or the step is too long
            const bool level = -w.down[l] <= kLevel * w.scale[l];
            if (!has(was_fresh, l)) {
                w.refactor |= 1u << l;
            } else {
                w.running &= ~(1u << l);
                if (!level) w.failed |= 1u << l;
            }
            continue;
        }
        if (!has(taken, l)) continue;
        const bool whole = w.alpha[l] == 1;
        // Newton's method with a factor of this point either halves the change at the least or has
        // come as far as rounding lets it
        const bool level = has(was_fresh, l) && w.change[l] > 0.5 * w.last_change[l] &&
                           -w.down[l] <= kLevel * w.scale[l];
        if (whole && (w.change[l] < rules.tolerance || level)) {
            w.running &= ~(1u << l);
            continue;
        }
        // the slope that is left at the new point foretells what the same factor would do next
        if (!whole || w.change[l] > kStall * w.last_change[l] ||
            std::fabs(w.slope_try[l]) > kStall * -w.down[l])
            w.refactor |= 1u << l;
        w.last_change[l] = w.change[l];
    }
}

void newton_push(const RodPasses& passes, RodWorkspace& w, const double* change) {
    const std::uint32_t moved = passes.push(w.block, change, w.v.data(), w.target.data(),
                                            w.gradient.data(), w.energy.data(), w.scale.data());
    w.running |= moved & ~w.failed;
    for (std::uint32_t l = 0; l < passes.lanes; ++l)
        if (has(moved, l)) w.last_change[l] = HUGE_VAL;
}

}  // namespace keratin
