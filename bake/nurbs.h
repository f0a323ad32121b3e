// NURBS curves that are known to be sound, and what the bake asks of them: points, derivatives, arc
// length, polylines. METHODS has no section on these; The NURBS Book (Piegl & Tiller) ch. 4 is the
// source of the formulas.
#pragma once

#include "bake/raw_groom.h"
#include "schema/result.h"

#include <Eigen/Core>
#include <unsupported/Eigen/Splines>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace keratin {

constexpr int kMaxDegree = 25;
// Of the largest weight to the smallest: beyond it the quotient loses its last digits.
constexpr double kMaxWeightRatio = 1e6;

// What is wrong with a curve of `degree` (1 or more), or nothing. A sound curve has degree + 1
// points or more, one weight a point (or none: all 1), points + degree + 1 knots, all finite; knots
// that do not decrease, none more than degree + 1 times, with a valid range
// [knots[degree], knots[point count]] that is not empty; weights > 0 and within kMaxWeightRatio.
std::optional<std::string> find_nurbs_fault(std::span<const Vec3> points,
                                            std::span<const double> weights,
                                            std::span<const double> knots, int degree);

// Position and derivatives by the curve's parameter.
struct CurveSample {
    Vec3 position, first, second;
};

class NurbsCurve {
  public:
    // Errors (input): what find_nurbs_fault says.
    static Result<NurbsCurve> make(std::span<const Vec3> points, std::span<const double> weights,
                                   std::span<const double> knots, int degree);

    int degree() const { return degree_; }
    // The range of parameters in which the curve is defined; arguments are clamped to it.
    double u_min() const { return u_min_; }
    double u_max() const { return u_max_; }
    // At a knot of multiplicity degree + 1, where the curve jumps, the limit from the right.
    Vec3 position(double u) const;
    CurveSample sample(double u) const;
    // Where the curve may lose smoothness: the distinct knots of the valid range, ends included.
    std::span<const double> breaks() const { return breaks_; }
    double polygon_length() const { return polygon_length_; }  // of the control points

  private:
    using Homogeneous = Eigen::Spline<double, 4, Eigen::Dynamic>;
    NurbsCurve(std::span<const Vec3> points, std::span<const double> weights,
               std::span<const double> knots, int degree);

    Homogeneous spline_;  // of (w x, w y, w z, w), relative to origin_
    int degree_;
    Vec3 origin_;  // the first control point: far from the world's origin digits would be lost
    double u_min_ = 0, u_max_ = 0, polygon_length_ = 0;
    std::vector<double> breaks_;
};

// Length of the curve from u_begin to u_end (in order, clamped to the valid range), to about 1e-10
// of the length of its control polygon.
double arc_length(const NurbsCurve& curve, double u_begin, double u_end);

// `count` >= 2 points from u_begin to u_end, ends included, at equal steps of arc length.
std::vector<Vec3> points_by_arc_length(const NurbsCurve& curve, double u_begin, double u_end,
                                       std::size_t count);

struct FittedPoints {
    std::vector<Vec3> points;  // at equal steps of arc length
    double error = 0;          // largest distance of the curve from the polyline, as sampled
};

// The least number of points, 2..max_count, whose polyline stays within max_error of the curve; the
// number max_count and the error reached where none does. The distance is taken at seven places
// between two points and at the curve's breaks.
FittedPoints points_by_max_error(const NurbsCurve& curve, double u_begin, double u_end,
                                 double max_error, std::size_t max_count);

}  // namespace keratin
