#include "bake/nurbs.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace keratin {
namespace {

// Gauss-Legendre on [-1, 1], 8 nodes: exact for polynomials of degree 15.
constexpr std::array<double, 4> kGaussNode = {0.18343464249564980494, 0.52553240991632898582,
                                              0.79666647741362673959, 0.96028985649753623168};
constexpr std::array<double, 4> kGaussWeight = {0.36268378337836198297, 0.31370664587788728734,
                                                0.22238103445337447054, 0.10122853629037625915};

// A quadrature interval is halved until both halves together agree with the whole to this part of
// the control polygon's length, or so often that a cusp is as good as reached.
constexpr double kLengthTolerance = 1e-10;
// Below this part no difference between two rules is worth another cut: it may be round-off.
constexpr double kLengthRoundoff = 1e-14;
constexpr int kMaxHalvings = 30;

std::string at_knot(std::span<const double> knots, std::size_t i) {
    return " at knot " + std::to_string(i) + " (" + std::to_string(knots[i]) + ')';
}

// Length of a part of the curve that is smooth and well resolved by one rule.
double gauss_length(const NurbsCurve& curve, double a, double b) {
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    double sum = 0;
    for (std::size_t i = 0; i < kGaussNode.size(); ++i)
        sum += kGaussWeight[i] * (curve.sample(middle - half * kGaussNode[i]).first.norm() +
                                  curve.sample(middle + half * kGaussNode[i]).first.norm());
    return half * sum;
}

// Arc length as a function of the parameter, on intervals that one Gauss rule resolves.
class LengthTable {
  public:
    LengthTable(const NurbsCurve& curve, double u_begin, double u_end) : curve_(curve) {
        u_begin = std::clamp(u_begin, curve.u_min(), curve.u_max());
        u_end = std::clamp(u_end, u_begin, curve.u_max());
        u_.push_back(u_begin);
        length_.push_back(0);
        const double tolerance = kLengthTolerance * curve.polygon_length();
        roundoff_ = kLengthRoundoff * curve.polygon_length();
        double a = u_begin;
        for (double knot : curve.breaks()) {
            if (knot <= a || knot >= u_end) continue;
            add(a, knot, gauss_length(curve, a, knot), tolerance, kMaxHalvings);
            a = knot;
        }
        if (u_end > a) add(a, u_end, gauss_length(curve, a, u_end), tolerance, kMaxHalvings);
    }

    double total() const { return length_.back(); }
    double u_begin() const { return u_.front(); }
    double u_end() const { return u_.back(); }

    // The parameter at which the arc length from the start is `target`.
    double parameter_at(double target) const {
        const auto above = std::upper_bound(length_.begin(), length_.end(), target);
        if (above == length_.end()) return u_.back();
        if (above == length_.begin()) return u_.front();
        const auto i = static_cast<std::size_t>(above - length_.begin());
        // Newton's method inside the interval, halving it where a step would leave it.
        double low = u_[i - 1], high = u_[i];
        double u = low + (high - low) * (target - length_[i - 1]) / (length_[i] - length_[i - 1]);
        const double close = kLengthTolerance * total();
        constexpr int kMaxSteps = 60;
        for (int step = 0; step < kMaxSteps; ++step) {
            const double miss = length_[i - 1] + gauss_length(curve_, u_[i - 1], u) - target;
            if (std::abs(miss) <= close) break;
            (miss > 0 ? high : low) = u;
            const double speed = curve_.sample(u).first.norm();
            const double next = u - miss / speed;
            u = next > low && next < high ? next : 0.5 * (low + high);
        }
        return u;
    }

  private:
    void add(double a, double b, double whole, double tolerance, int halvings) {
        const double middle = 0.5 * (a + b);
        const double left = gauss_length(curve_, a, middle);
        const double right = gauss_length(curve_, middle, b);
        if (halvings == 0 || std::abs(left + right - whole) <= std::max(tolerance, roundoff_)) {
            for (const auto& [u, length] : {std::pair{middle, left}, std::pair{b, right}}) {
                u_.push_back(u);
                length_.push_back(length_.back() + length);
            }
            return;
        }
        add(a, middle, left, 0.5 * tolerance, halvings - 1);
        add(middle, b, right, 0.5 * tolerance, halvings - 1);
    }

    const NurbsCurve& curve_;
    double roundoff_ = 0;
    std::vector<double> u_, length_;  // increasing, from the start
};

std::vector<double> equal_steps(const LengthTable& table, std::size_t count) {
    std::vector<double> u(count);
    u.front() = table.u_begin();
    u.back() = table.u_end();
    for (std::size_t k = 1; k + 1 < count; ++k)
        u[k] = table.parameter_at(table.total() * static_cast<double>(k) /
                                  static_cast<double>(count - 1));
    return u;
}

double distance_to_segment(const Vec3& x, const Vec3& a, const Vec3& b) {
    const Vec3 edge = b - a;
    const double squared = edge.squaredNorm();
    const double t = squared > 0 ? std::clamp((x - a).dot(edge) / squared, 0.0, 1.0) : 0;
    return (x - a - t * edge).norm();
}

FittedPoints fit(const NurbsCurve& curve, const LengthTable& table, std::size_t count) {
    const std::vector<double> u = equal_steps(table, count);
    FittedPoints fitted;
    fitted.points.reserve(count);
    for (double parameter : u) fitted.points.push_back(curve.position(parameter));
    const auto measure = [&](std::size_t k, double parameter) {
        fitted.error = std::max(
            fitted.error,
            distance_to_segment(curve.position(parameter), fitted.points[k], fitted.points[k + 1]));
    };
    auto next_break = curve.breaks().begin();
    for (std::size_t k = 0; k + 1 < count; ++k) {
        constexpr int kPlaces = 8;
        for (int i = 1; i < kPlaces; ++i) measure(k, u[k] + (u[k + 1] - u[k]) * i / kPlaces);
        for (; next_break != curve.breaks().end() && *next_break < u[k + 1]; ++next_break)
            if (*next_break > u[k]) measure(k, *next_break);
    }
    return fitted;
}

}  // namespace

std::optional<std::string> find_nurbs_fault(std::span<const Vec3> points,
                                            std::span<const double> weights,
                                            std::span<const double> knots, int degree) {
    if (degree < 1 || degree > kMaxDegree)
        return "the degree " + std::to_string(degree) + " is not between 1 and " +
               std::to_string(kMaxDegree);
    const auto p = static_cast<std::size_t>(degree);
    const std::size_t n = points.size();
    if (n < p + 1)
        return std::to_string(n) + (n == 1 ? " point is" : " points are") +
               " too few: a curve of degree " + std::to_string(p) + " needs " +
               std::to_string(p + 1);
    if (knots.size() != n + p + 1)
        return std::to_string(knots.size()) + " knots are too " +
               (knots.size() < n + p + 1 ? "few: " : "many: ") + std::to_string(n) +
               " points of degree " + std::to_string(p) + " need " + std::to_string(n + p + 1);
    if (!weights.empty() && weights.size() != n)
        return std::to_string(weights.size()) + " weights for " + std::to_string(n) + " points";
    for (std::size_t i = 0; i < n; ++i)
        if (!is_usable(points[i]))
            return "point " + std::to_string(i) + " is not finite or is immensely far away";
    double smallest = 1, largest = 1;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        if (!std::isfinite(weights[i]) || weights[i] <= 0)
            return "weight " + std::to_string(i) + " is " + std::to_string(weights[i]) +
                   "; weights must be above 0";
        smallest = i == 0 ? weights[i] : std::min(smallest, weights[i]);
        largest = i == 0 ? weights[i] : std::max(largest, weights[i]);
    }
    if (largest > kMaxWeightRatio * smallest)
        return "the weights differ by more than a factor of a million";
    std::size_t run = 1;
    for (std::size_t i = 0; i < knots.size(); ++i) {
        if (!std::isfinite(knots[i])) return "knot " + std::to_string(i) + " is not finite";
        if (i == 0) continue;
        if (knots[i] < knots[i - 1])
            return "the knots are not sorted: they decrease" + at_knot(knots, i);
        run = knots[i] == knots[i - 1] ? run + 1 : 1;
        if (run > p + 1)
            return "a knot stands more than " + std::to_string(p + 1) + " times" +
                   at_knot(knots, i);
    }
    if (knots[p] >= knots[n]) return "the knots leave no range in which the curve is defined";
    return {};
}

Result<NurbsCurve> NurbsCurve::make(std::span<const Vec3> points, std::span<const double> weights,
                                    std::span<const double> knots, int degree) {
    if (auto fault = find_nurbs_fault(points, weights, knots, degree))
        return Error{ErrorCode::input, "", *fault};
    return NurbsCurve(points, weights, knots, degree);
}

NurbsCurve::NurbsCurve(std::span<const Vec3> points, std::span<const double> weights,
                       std::span<const double> knots, int degree)
    : degree_(degree), origin_(points[0]) {
    const auto p = static_cast<std::size_t>(degree);
    std::size_t n = points.size();
    // Where the valid range ends on a repeated knot, the last point has no part in it; without it
    // the last span has a length, which Eigen's search for the span of u_max relies on.
    while (knots[n - 1] == knots[n]) --n;
    Eigen::Matrix<double, 4, Eigen::Dynamic> control(4, n);
    for (std::size_t i = 0; i < n; ++i) {
        const double weight = weights.empty() ? 1 : weights[i];
        control.col(static_cast<Eigen::Index>(i)) << weight * (points[i] - origin_), weight;
        if (i > 0) polygon_length_ += (points[i] - points[i - 1]).norm();
    }
    using Knots = Homogeneous::KnotVectorType;
    spline_ = Homogeneous(
        Eigen::Map<const Knots>(knots.data(), static_cast<Eigen::Index>(n + p + 1)), control);
    u_min_ = knots[p];
    u_max_ = knots[n];
    for (std::size_t i = p; i <= n; ++i)
        if (breaks_.empty() || knots[i] > breaks_.back()) breaks_.push_back(knots[i]);
}

Vec3 NurbsCurve::position(double u) const {
    const Eigen::Vector4d h = spline_(std::clamp(u, u_min_, u_max_)).matrix();
    return origin_ + h.head<3>() / h.w();
}

// The NURBS Book eq. 4.8: with A = w C, C' = (A' - w' C) / w, C'' = (A'' - 2 w' C' - w'' C) / w.
CurveSample NurbsCurve::sample(double u) const {
    const int order = std::min(degree_, 2);
    const auto h = spline_.derivatives(std::clamp(u, u_min_, u_max_), order);
    const auto column = [&](int k) -> Eigen::Vector4d {
        return k <= order ? Eigen::Vector4d(h.col(k).matrix()) : Eigen::Vector4d::Zero();
    };
    const Eigen::Vector4d a = column(0), d1 = column(1), d2 = column(2);
    CurveSample sample;
    const Vec3 local = a.head<3>() / a.w();
    sample.position = origin_ + local;
    sample.first = (d1.head<3>() - d1.w() * local) / a.w();
    sample.second = (d2.head<3>() - 2 * d1.w() * sample.first - d2.w() * local) / a.w();
    return sample;
}

double arc_length(const NurbsCurve& curve, double u_begin, double u_end) {
    return LengthTable(curve, u_begin, u_end).total();
}

std::vector<Vec3> points_by_arc_length(const NurbsCurve& curve, double u_begin, double u_end,
                                       std::size_t count) {
    assert(count >= 2);
    const LengthTable table(curve, u_begin, u_end);
    std::vector<Vec3> points;
    points.reserve(count);
    for (double u : equal_steps(table, count)) points.push_back(curve.position(u));
    return points;
}

FittedPoints points_by_max_error(const NurbsCurve& curve, double u_begin, double u_end,
                                 double max_error, std::size_t max_count) {
    assert(max_count >= 2);
    const LengthTable table(curve, u_begin, u_end);
    // Double the segments until they suffice, then halve the distance to the last that did not.
    std::size_t too_few = 1, enough = 2;
    FittedPoints best = fit(curve, table, enough);
    while (best.error > max_error && enough < max_count) {
        too_few = enough;
        enough = std::min(2 * enough - 1, max_count);
        best = fit(curve, table, enough);
    }
    if (best.error > max_error) return best;
    while (too_few + 1 < enough) {
        const std::size_t middle = (too_few + enough) / 2;
        FittedPoints tried = fit(curve, table, middle);
        if (tried.error > max_error) {
            too_few = middle;
        } else {
            enough = middle;
            best = std::move(tried);
        }
    }
    return best;
}

}  // namespace keratin
