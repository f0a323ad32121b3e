// The static reference of a clamped strand that is straight at rest and hangs under gravity: the planar
// elastica B theta'' = w (L - s) cos theta, theta(0) given, theta'(L) = 0.
#pragma once

#include "runtime/rod/rod_strand.h"

#include <span>
#include <vector>

namespace keratin::report {

// Points at the arc lengths `at` (m, 0..length) from the clamp, relative to it; gravity along -y.
//   direction  unit, of the clamp
//   weight     N/m;  bending  N m^2, EI
std::vector<Double3> hanging_shape(const Double3& direction, double length, double weight, double bending,
                                   std::span<const double> at);

}  // namespace keratin::report
