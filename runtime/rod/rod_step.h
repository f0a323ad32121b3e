// One step of all strands: what is prescribed and applied goes into each block's problem, Newton's
// method solves it, strands that do not converge repeat it in halves (METHODS §2.3, 2.4).
#pragma once

#include "runtime/rod/rod_newton.h"
#include "runtime/rod/rod_simulation.h"

#include <memory>
#include <vector>

namespace keratin {

struct RodStepper {
    RodSettings settings;
    const RodPasses* passes = nullptr;
    RodBlocks blocks;
    double time = 0;
    ContactSolver* contact = nullptr;

    // One for each thread; with contact one for each block.
    std::vector<std::unique_ptr<RodWorkspace>> work;
    std::vector<RodStepReport> block_report;  // [blocks]
    // With contact: laid out as RodLayout.
    AlignedDoubles contact_v, impulse, impulse_before;
    std::vector<RodConvergence> convergence;
    RodStats stats;

    RodScales scales() const {
        return {settings.stretch_scale, settings.bend_scale, settings.twist_scale};
    }
};

// Workspaces as contact or its absence asks for.
void lay_out_work(RodStepper& stepper);

// Advances by h. Ends that shall move are at their targets afterwards.
RodStepReport take_step(RodStepper& stepper, double h);

// Number of threads a step uses.
int thread_count(const RodSettings& settings);

}  // namespace keratin
