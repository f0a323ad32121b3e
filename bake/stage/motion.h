// A groom in motion, every strand simulated: what guide selection by motion learns from, and what
// the interpolation error is measured against.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/weights.h"
#include "schema/result.h"

#include <functional>
#include <span>
#include <vector>

namespace keratin {

// How far each point is from its place at rest, in the frame of its root, at some moments.
struct GroomMotion {
    std::size_t frame_count = 0;
    std::vector<float> displacement;  // [frame_count][groom points][3] m
};

// Simulates all strands of a groom for a short while. main.cpp hands one in, as the bake's library
// knows no solver.
using Simulate = std::function<Result<GroomMotion>(const Groom&)>;

// Distance of strands a and b in motion: root mean square over frames and arc length of the
// difference of their displacements, m. Strands with different numbers of points are compared at
// the points of a.
double motion_distance(const Groom& groom, const GroomMotion& motion, std::size_t a, std::size_t b);

// The same against rest: root mean square of the displacements of a, m.
double motion_size(const Groom& groom, const GroomMotion& motion, std::size_t a);

// How far the render strands end up from where they would be had they been simulated themselves:
// distances over all points and frames of the strands that are not guides, m. METHODS 1.5.
Spread reconstruction_error(const Groom& groom, const GroomMotion& motion,
                            std::span<const GuideBlend> blends);

}  // namespace keratin
