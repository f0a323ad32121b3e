#include "tools/keratin-fit/fit_curve.h"

#include "bake/nurbs.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace keratin {
namespace {

constexpr std::size_t kDegree = 3;
constexpr int kRounds = 40;
constexpr int kRoundsPerFoot = 4;  // the points' parameters move every so many rounds
// How much a point counts: the ends are to meet the strand's root and tip.
constexpr double kEndWeight = 8;
// The pull of a weight's logarithm towards 0, as a part of the strand's length.
constexpr double kWeightPull = 2e-4;

std::vector<double> make_knots(std::size_t control_points, KnotEnds ends) {
    std::vector<double> knots(control_points + kDegree + 1);
    const auto last = static_cast<double>(control_points);
    for (std::size_t i = 0; i < knots.size(); ++i) {
        knots[i] = static_cast<double>(i);
        if (ends == KnotEnds::clamped)
            knots[i] = std::clamp(knots[i], static_cast<double>(kDegree), last);
    }
    // The curve itself runs from 0 to 1.
    const double first = kDegree, range = last - first;
    for (double& knot : knots) knot = (knot - first) / range;
    return knots;
}

// The four cubic basis functions at u that are not 0, and the first control point they belong to
// (The NURBS Book, algorithm A2.2).
std::size_t basis(std::span<const double> knots, double u, std::array<double, kDegree + 1>& n) {
    std::size_t span = kDegree;
    while (span + kDegree + 2 < knots.size() && knots[span + 1] <= u) ++span;
    n[0] = 1;
    for (std::size_t j = 1; j <= kDegree; ++j) {
        double saved = 0;
        for (std::size_t r = 0; r < j; ++r) {
            const double right = knots[span + r + 1], left = knots[span + 1 - j + r];
            const double part = n[r] / (right - left);
            n[r] = saved + (right - u) * part;
            saved = (u - left) * part;
        }
        n[j] = saved;
    }
    return span - kDegree;
}

// Residuals of a fit and their derivatives by the unknowns (x, y, z of each control point, then
// the logarithm of each weight).
class Problem {
  public:
    Problem(std::span<const Vec3> points, std::span<const double> knots, double length)
        : points_(points),
          knots_(knots),
          count_(knots.size() - kDegree - 1),
          pull_(kWeightPull * length) {}

    std::size_t unknowns() const { return 4 * count_; }
    std::size_t residuals() const { return 3 * points_.size() + count_; }

    void evaluate(const Eigen::VectorXd& x, std::span<const double> u, Eigen::VectorXd& residual,
                  Eigen::MatrixXd* jacobian) const {
        if (jacobian) jacobian->setZero();
        for (std::size_t i = 0; i < points_.size(); ++i) {
            std::array<double, kDegree + 1> n;
            const std::size_t first = basis(knots_, u[i], n);
            double sum = 0;
            Vec3 at = Vec3::Zero();
            for (std::size_t j = 0; j <= kDegree; ++j) {
                n[j] *= std::exp(x[log_weight(first + j)]);
                sum += n[j];
                at += n[j] * x.segment<3>(3 * index(first + j));
            }
            at /= sum;
            const double weight = i == 0 || i + 1 == points_.size() ? kEndWeight : 1;
            residual.segment<3>(3 * index(i)) = weight * (at - points_[i]);
            if (!jacobian) continue;
            for (std::size_t j = 0; j <= kDegree; ++j) {
                const double share = weight * n[j] / sum;
                const auto column = 3 * index(first + j);
                for (int axis = 0; axis < 3; ++axis)
                    (*jacobian)(3 * index(i) + axis, column + axis) = share;
                jacobian->block<3, 1>(3 * index(i), log_weight(first + j)) =
                    share * (x.segment<3>(column) - at);
            }
        }
        for (std::size_t j = 0; j < count_; ++j) {
            const auto row = 3 * index(points_.size()) + index(j);
            residual[row] = pull_ * x[log_weight(j)];
            if (jacobian) (*jacobian)(row, log_weight(j)) = pull_;
        }
    }

  private:
    static Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }
    Eigen::Index log_weight(std::size_t j) const { return index(3 * count_ + j); }

    std::span<const Vec3> points_;
    std::span<const double> knots_;
    std::size_t count_;
    double pull_;
};

RawCurve to_curve(const Eigen::VectorXd& x, const std::vector<double>& knots) {
    RawCurve curve;
    curve.degree = kDegree;
    curve.knots = knots;
    curve.u_begin = 0;
    curve.u_end = 1;
    const std::size_t count = knots.size() - kDegree - 1;
    for (std::size_t j = 0; j < count; ++j) {
        curve.points.push_back(x.segment<3>(static_cast<Eigen::Index>(3 * j)));
        curve.weights.push_back(std::exp(x[static_cast<Eigen::Index>(3 * count + j)]));
    }
    return curve;
}

NurbsCurve to_nurbs(const RawCurve& curve) {
    auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, curve.degree);
    assert(nurbs);
    return std::move(*nurbs);
}

// One Newton step of each inner point's parameter to the foot of its perpendicular, kept in order.
void move_to_feet(const NurbsCurve& nurbs, std::span<const Vec3> points, std::span<double> u) {
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        const CurveSample at = nurbs.sample(u[i]);
        const Vec3 miss = at.position - points[i];
        const double slope = at.first.squaredNorm() + miss.dot(at.second);
        const double moved = u[i] - miss.dot(at.first) / slope;
        if (moved > u[i - 1] && moved < u[i + 1]) u[i] = moved;
    }
}

}  // namespace

CurveFit fit_rational_cubic(std::span<const Vec3> points, std::size_t control_points,
                            KnotEnds ends) {
    assert(points.size() >= 2 && control_points >= kMinControlPoints);
    const std::vector<double> knots = make_knots(control_points, ends);
    std::vector<double> u(points.size(), 0);
    for (std::size_t i = 1; i < points.size(); ++i)
        u[i] = u[i - 1] + (points[i] - points[i - 1]).norm();
    const double length = u.back();
    for (double& parameter : u) parameter /= length;

    // Start on the strand, each control point at its Greville parameter.
    const Problem problem(points, knots, length);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.unknowns()));
    for (std::size_t j = 0; j < control_points; ++j) {
        const double at = std::clamp((knots[j + 1] + knots[j + 2] + knots[j + 3]) / 3, 0.0, 1.0);
        const auto above = std::upper_bound(u.begin() + 1, u.end() - 1, at);
        const auto i = static_cast<std::size_t>(above - u.begin());
        const double t = (at - u[i - 1]) / std::max(u[i] - u[i - 1], 1e-300);
        x.segment<3>(static_cast<Eigen::Index>(3 * j)) =
            points[i - 1] + std::min(t, 1.0) * (points[i] - points[i - 1]);
    }

    const auto rows = static_cast<Eigen::Index>(problem.residuals());
    Eigen::VectorXd residual(rows), tried(rows);
    Eigen::MatrixXd jacobian(rows, x.size());
    double damping = 1e-3;
    for (int round = 0; round < kRounds; ++round) {
        problem.evaluate(x, u, residual, &jacobian);
        Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
        normal.diagonal() *= 1 + damping;
        normal.diagonal().array() += 1e-12;
        const Eigen::VectorXd next = x - normal.ldlt().solve(jacobian.transpose() * residual);
        problem.evaluate(next, u, tried, nullptr);
        if (tried.squaredNorm() < residual.squaredNorm()) {
            x = next;
            damping = std::max(0.2 * damping, 1e-9);
        } else {
            damping *= 5;
        }
        if (round % kRoundsPerFoot == kRoundsPerFoot - 1)
            move_to_feet(to_nurbs(to_curve(x, knots)), points, u);
    }

    CurveFit fit;
    fit.curve = to_curve(x, knots);
    const NurbsCurve nurbs = to_nurbs(fit.curve);
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double squared = (nurbs.position(u[i]) - points[i]).squaredNorm();
        sum += squared;
        fit.max_error = std::max(fit.max_error, std::sqrt(squared));
    }
    fit.rms_error = std::sqrt(sum / static_cast<double>(points.size()));
    return fit;
}

}  // namespace keratin
