// Rational cubics through strands of points: how the NURBS groom in data/nurbs was made.
#pragma once

#include "bake/raw_groom.h"

#include <span>
#include <vector>

namespace keratin {

enum class KnotEnds {
    clamped,    // the curve starts and ends on its first and last control point
    unclamped,  // evenly spaced knots: it starts and ends inside its control polygon
};

struct CurveFit {
    RawCurve curve;  // degree 3, its weights unequal as a rule
    double rms_error = 0,
           max_error = 0;  // distance of the strand's points from the curve, its unit
};

constexpr std::size_t kMinControlPoints = 4;

// The rational cubic of `control_points` >= kMinControlPoints evenly spaced control points that
// comes nearest to the points of a strand, in the sense of least squares over positions and weights
// (Levenberg-Marquardt; the logarithms of the weights are held back a little so that they stay
// within reason), the points' parameters being moved to their feet on the curve in between.
// points  [>= 2], finite, not all the same
CurveFit fit_rational_cubic(std::span<const Vec3> points, std::size_t control_points,
                            KnotEnds ends);

}  // namespace keratin
