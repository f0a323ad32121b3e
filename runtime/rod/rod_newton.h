// Newton's method with backtracking for the velocities of one block (METHODS §2.3, Algorithm 1), one
// iteration at a time. Every lane is a strand of its own: what it does never depends on its
// neighbours, and a strand that has converged takes no further part.
#pragma once

#include "runtime/rod/rod_blocks.h"

#include <array>

namespace keratin {

template <class T>
using PerLane = std::array<T, kRodMaxLanes>;

// Whether a mask of lanes has this one.
inline bool has(std::uint32_t mask, std::uint32_t lane) { return (mask >> lane & 1u) != 0; }

// Everything one block needs during a step. Laid out for the largest block it shall serve.
struct RodWorkspace {
    RodWorkspace(std::size_t rows, std::uint32_t lanes);

    AlignedDoubles v, v_try, gradient, gradient_try, weight, target;  // [4 V]
    AlignedDoubles direction;                                         // [4 V] with pad rows
    AlignedDoubles frames, frames_try;                                // [V][kRodFrame]
    AlignedDoubles edges, joints;         // with viscosity; as RodBlock
    AlignedDoubles ends;                  // [12]
    AlignedDoubles strains;               // [V][kRodStrain]
    AlignedDoubles band, band_new;        // with pad rows
    AlignedDoubles alpha, energy, scale, slope, energy_try, scale_try, slope_try, norm, down, exact;
    AlignedDoubles reach;  // [1] m: largest coordinate of the strand, from the origin

    double* direction_rows(std::uint32_t lanes) { return direction.data() + kRodPadRows * lanes; }
    double* band_rows(std::uint32_t lanes) {
        return band.data() + kRodPadRows * kRodBandWidth * lanes;
    }

    RodBlock block;
    std::uint32_t used = 0;        // lanes with a strand
    std::uint32_t running = 0;     // lanes that take part
    std::uint32_t refactor = 0;    // lanes whose factor shall be new
    std::uint32_t fresh = 0;       // lanes whose factor belongs to their present v
    std::uint32_t factored = 0;    // lanes that have a factor
    std::uint64_t version = 0;     // of the factors, counts up
    std::uint32_t failed = 0;      // lanes that Newton's method gave up
    std::uint32_t indefinite = 0;  // lanes whose whole Hessian was not positive in this step
    std::uint32_t lost = 0;        // lanes that were not finite in some part of this step
    PerLane<std::uint32_t> iterations{};
    PerLane<double> change{};      // m/s: |dv| / dim v of the last iteration
    PerLane<double> last_change{};
    PerLane<double> dimension{};  // numbers of the strand
};

struct NewtonRules {
    double tolerance = 1e-8;  // m/s
    RodNewton kind = RodNewton::quasi;
};

// Evaluates v (already in the workspace, prescribed numbers with their velocity) with the workspace's
// frames, and makes `lanes` run.
void newton_begin(const RodPasses& passes, RodWorkspace& work, std::uint32_t lanes);
// Where g(v + direction) < g(v) takes v + direction: another first guess.
void newton_offer(const RodPasses& passes, RodWorkspace& work, std::uint32_t lanes);
// The first half of an iteration: renews factors where asked for and sets the direction of the running
// lanes.
void newton_direct(const RodPasses& passes, RodWorkspace& work, const NewtonRules& rules);
// The direction again with the factors as they are, after newton_push.
void newton_redirect(const RodPasses& passes, RodWorkspace& work);
// The second half: goes along the direction as far as g falls.
void newton_take(const RodPasses& passes, RodWorkspace& work, const NewtonRules& rules);
// One iteration of the running lanes: both halves.
void newton_iterate(const RodPasses& passes, RodWorkspace& work, const NewtonRules& rules);
// The impulse of the given lanes has changed by `change` ([4 V], 0 elsewhere): v has to follow.
void newton_push(const RodPasses& passes, RodWorkspace& work, const double* change);

}  // namespace keratin
