// How strands move and crowd together as a mass: what friction and volume preservation change.
#pragma once

#include "tools/measure/point.h"

#include <array>
#include <vector>

namespace keratin::measure {

// Pairs of points of different strands that lie within `radius` (m) of each other, lower index
// first, sorted. Measured on the rest pose, the same pairs are followed through a run.
std::vector<std::array<std::uint32_t, 2>> neighbours(const Strands& strands, double radius);

// Mean |v_a - v_b| (m/s) over pairs of points.
//   velocity [points] m/s
double relative_speed(std::span<const std::array<std::uint32_t, 2>> pairs,
                      std::span<const Point> velocity);

// The given percentile (0..100) of the mass density (kg/m^3) over the cells of a grid of `spacing`
// (m) that hold any mass; each point puts its mass into the eight nodes around it, trilinearly.
//   mass [points] kg
double density_percentile(std::span<const Point> position, std::span<const double> mass,
                          double spacing, double percentile);

}  // namespace keratin::measure
