// A step of all strands together, with contact between them (METHODS §2.4).
#pragma once

#include "runtime/rod/rod_solver.h"

namespace keratin {

// Advances by a part of the step of `whole` seconds; in halves where it does not converge or ends
// with strands overlapping. depth: how often it has been halved.
void advance_scene(RodSolver& solver, const RodPart& part, double whole, std::uint32_t depth,
                   RodStepReport& report);

}  // namespace keratin
