#include "bake/nurbs.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>

using namespace keratin;

namespace {

struct Curve {
    std::vector<Vec3> points;
    std::vector<double> weights, knots;
    int degree = 3;
    NurbsCurve make() const {
        auto curve = NurbsCurve::make(points, weights, knots, degree);
        if (!curve) FAIL(curve.error().message);
        return std::move(*curve);
    }
};

using Long3 = std::array<long double, 3>;

// De Boor's algorithm (The NURBS Book §5.2 read as repeated knot insertion) in long double: the
// truth that the curve type is held against. Takes the span that begins at or before u, and at the
// end of the valid range the last one that has a length.
Long3 de_boor(const Curve& curve, double u) {
    const std::size_t p = static_cast<std::size_t>(curve.degree), n = curve.points.size();
    std::size_t span = p;
    for (std::size_t i = p; i < n; ++i)
        if (curve.knots[i] < curve.knots[i + 1] && curve.knots[i] <= u) span = i;
    std::vector<std::array<long double, 4>> d(p + 1);
    for (std::size_t j = 0; j <= p; ++j) {
        const std::size_t i = span - p + j;
        const long double w = curve.weights.empty() ? 1.0L : curve.weights[i];
        for (int axis = 0; axis < 3; ++axis) d[j][axis] = w * curve.points[i][axis];
        d[j][3] = w;
    }
    for (std::size_t r = 1; r <= p; ++r)
        for (std::size_t j = p; j >= r; --j) {
            const long double low = curve.knots[span - p + j], high = curve.knots[span + 1 + j - r];
            const long double t = (static_cast<long double>(u) - low) / (high - low);
            for (int k = 0; k < 4; ++k) d[j][k] = (1 - t) * d[j - 1][k] + t * d[j][k];
        }
    return {d[p][0] / d[p][3], d[p][1] / d[p][3], d[p][2] / d[p][3]};
}

enum class Ends { clamped, unclamped };

// Coordinates in [-1, 1], weights from 0.01 to 100, uneven knots of which some are repeated.
Curve random_curve(std::mt19937_64& random, Ends ends) {
    const auto integer = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    Curve curve;
    curve.degree = integer(1, 7);
    const int n = curve.degree + 1 + integer(0, 20);
    for (int i = 0; i < n; ++i) {
        curve.points.emplace_back(real(-1, 1), real(-1, 1), real(-1, 1));
        curve.weights.push_back(std::pow(10.0, real(-2, 2)));
    }
    const int count = n + curve.degree + 1;
    double knot = real(-5, 5);
    int run = 1;
    for (int i = 0; i < count; ++i) {
        bool repeat = i > 0 && run < curve.degree + 1 && integer(0, 3) == 0;
        // The last knots must not use up the range; the ends are laid below when clamped.
        if (i == curve.degree + 1 || i == n) repeat = false;
        if (i > 0 && !repeat) knot += real(0.01, 2);
        run = repeat ? run + 1 : 1;
        curve.knots.push_back(knot);
    }
    if (ends == Ends::clamped) {
        for (int i = 0; i < curve.degree; ++i) curve.knots[i] = curve.knots[curve.degree];
        for (int i = n; i < count; ++i) curve.knots[i] = knot;
    }
    return curve;
}

// A full circle of radius 1 about (x, 0, 0) as a rational quadratic.
Curve circle(double x) {
    const double h = std::sqrt(0.5);
    Curve curve;
    curve.degree = 2;
    curve.points = {{x + 1, 0, 0},  {x + 1, 1, 0}, {x, 1, 0},      {x - 1, 1, 0}, {x - 1, 0, 0},
                    {x - 1, -1, 0}, {x, -1, 0},    {x + 1, -1, 0}, {x + 1, 0, 0}};
    curve.weights = {1, h, 1, h, 1, h, 1, h, 1};
    curve.knots = {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
    return curve;
}

std::string fault_of(const Curve& curve) {
    return find_nurbs_fault(curve.points, curve.weights, curve.knots, curve.degree).value_or("");
}

Curve sound_cubic() {
    Curve curve;
    curve.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {2, 1, 0}, {3, 1, 0.5}};
    curve.weights = {1, 1, 1, 1, 1};
    curve.knots = {0, 0, 0, 0, 0.5, 1, 1, 1, 1};
    return curve;
}

}  // namespace

TEST_CASE("random rational, unclamped and repeated-knot curves agree with de Boor to 1e-12") {
    std::mt19937_64 random(20240607);
    double largest = 0;
    int curves = 0, unclamped = 0, repeated = 0;
    for (; curves < 2000; ++curves) {
        const Ends ends = curves % 2 == 0 ? Ends::clamped : Ends::unclamped;
        const Curve curve = random_curve(random, ends);
        const NurbsCurve nurbs = curve.make();
        unclamped += ends == Ends::unclamped;
        for (std::size_t i = curve.degree + 1; i < curve.points.size(); ++i)
            if (curve.knots[i] == curve.knots[i + 1]) {
                ++repeated;
                break;
            }
        std::vector<double> parameters(nurbs.breaks().begin(), nurbs.breaks().end());
        for (int i = 0; i <= 40; ++i)
            parameters.push_back(nurbs.u_min() + (nurbs.u_max() - nurbs.u_min()) * i / 40);
        for (double u : parameters) {
            u = std::min(u, nurbs.u_max());
            const Long3 truth = de_boor(curve, u);
            const Vec3 position = nurbs.position(u), sampled = nurbs.sample(u).position;
            for (int axis = 0; axis < 3; ++axis) {
                const double error =
                    std::max(std::abs(static_cast<double>(position[axis] - truth[axis])),
                             std::abs(static_cast<double>(sampled[axis] - truth[axis])));
                REQUIRE(error <= 1e-12);  // also refuses NaN
                largest = std::max(largest, error);
            }
        }
    }
    std::printf(
        "NURBS against long double de Boor: %d curves (%d unclamped, %d with repeated inner "
        "knots), largest error %.3g\n",
        curves, unclamped, repeated, largest);
    CHECK(repeated >= 300);
}

TEST_CASE("derivatives agree with finite differences of de Boor") {
    std::mt19937_64 random(7);
    for (int i = 0; i < 100; ++i) {
        const Curve curve = random_curve(random, Ends::unclamped);
        const NurbsCurve nurbs = curve.make();
        // Inside a span, well away from its ends, so that the difference meets no break.
        const double a = nurbs.breaks()[0], b = nurbs.breaks()[1];
        const double u = a + 0.4 * (b - a), h = 1e-4 * (b - a);
        const Long3 before = de_boor(curve, u - h), at = de_boor(curve, u),
                    after = de_boor(curve, u + h);
        const double step_before = u - (u - h), step_after = (u + h) - u;
        const CurveSample sample = nurbs.sample(u);
        const double scale = sample.first.norm() + sample.second.norm() * (b - a) + 1 / (b - a);
        for (int axis = 0; axis < 3; ++axis) {
            const double first =
                static_cast<double>((after[axis] - before[axis]) / (step_before + step_after));
            const double second =
                static_cast<double>((after[axis] - 2 * at[axis] + before[axis]) / (h * h));
            CHECK(std::abs(first - sample.first[axis]) <= 1e-4 * scale);
            CHECK(std::abs(second - sample.second[axis]) <= 1e-4 * scale / (b - a));
        }
    }
}

TEST_CASE("a rational circle has its radius, its length and evenly spaced points") {
    for (double x : {0.0, 1e6}) {
        const NurbsCurve nurbs = circle(x).make();
        // The spacing of doubles grows with the distance from the origin.
        const double rounding = 4 * std::numeric_limits<double>::epsilon() * (1 + x);
        const double length = arc_length(nurbs, 0, 4);
        std::printf("circle at %g: length off by %.3g\n", x, length - 2 * std::numbers::pi);
        CHECK(std::abs(length - 2 * std::numbers::pi) < 1e-9);
        CHECK(std::abs(arc_length(nurbs, 1, 2) - std::numbers::pi / 2) < 1e-9);
        const auto points = points_by_arc_length(nurbs, 0, 4, 25);
        REQUIRE(points.size() == 25);
        for (std::size_t k = 0; k < points.size(); ++k) {
            const double angle = 2 * std::numbers::pi * static_cast<double>(k) / 24;
            CHECK((points[k] - Vec3(x + std::cos(angle), std::sin(angle), 0)).norm() <
                  1e-8 + rounding);
        }
    }
}

TEST_CASE("points by max_error are the fewest that stay within it") {
    const NurbsCurve nurbs = circle(0).make();
    for (double max_error : {0.1, 0.01, 0.001}) {
        const FittedPoints fitted = points_by_max_error(nurbs, 0, 4, max_error, 1024);
        CHECK(fitted.error <= max_error);
        // A chord over the angle a stands off the circle by 1 - cos(a / 2).
        const double segments = std::ceil(std::numbers::pi / std::acos(1 - max_error));
        CHECK(fitted.points.size() == static_cast<std::size_t>(segments) + 1);
    }
    const FittedPoints capped = points_by_max_error(nurbs, 0, 4, 1e-6, 32);
    CHECK(capped.points.size() == 32);
    CHECK(capped.error > 1e-6);
    // Straight: two points do.
    Curve line;
    line.degree = 1;
    line.points = {{0, 0, 0}, {1, 2, 3}};
    line.knots = {0, 0, 1, 1};
    CHECK(points_by_max_error(line.make(), 0, 1, 1e-9, 32).points.size() == 2);
}

TEST_CASE("arc length copes with a cusp, coincident points and a range inside a span") {
    Curve cusp;  // (t^3, t^2, 0) on [-1, 1], as a Bezier cubic
    cusp.points = {{-1, 1, 0}, {1, -1.0 / 3, 0}, {-1, -1.0 / 3, 0}, {1, 1, 0}};
    cusp.knots = {0, 0, 0, 0, 1, 1, 1, 1};
    const double closed_form = 2 * (std::pow(13.0, 1.5) - 8) / 27;
    CHECK(std::abs(arc_length(cusp.make(), 0, 1) - closed_form) < 1e-8);
    Curve still = sound_cubic();
    for (Vec3& point : still.points) point = {1, 2, 3};
    still.weights = {1, 2, 3, 4, 5};
    CHECK(arc_length(still.make(), 0, 1) == 0);
    const auto points = points_by_arc_length(still.make(), 0, 1, 5);
    for (const Vec3& point : points) CHECK(point == Vec3(1, 2, 3));
    const NurbsCurve cubic = sound_cubic().make();
    CHECK(arc_length(cubic, 0, 0.3) + arc_length(cubic, 0.3, 1) ==
          Approx(arc_length(cubic, -7, 9)).epsilon(1e-9));
}

TEST_CASE("a range that ends on a repeated knot is evaluated up to its end") {
    Curve curve = sound_cubic();
    curve.knots = {0, 1, 2, 3, 4, 4, 5, 6, 7};  // valid range [3, 4]
    const NurbsCurve nurbs = curve.make();
    CHECK(nurbs.u_max() == 4);
    const Long3 truth = de_boor(curve, 4);
    for (int axis = 0; axis < 3; ++axis)
        CHECK(std::abs(nurbs.position(4)[axis] - static_cast<double>(truth[axis])) < 1e-15);
}

TEST_CASE("each fault of a curve is found and named") {
    CHECK(fault_of(sound_cubic()).empty());
    Curve curve = sound_cubic();
    curve.degree = 0;
    CHECK(fault_of(curve) == "the degree 0 is not between 1 and 25");
    curve = sound_cubic();
    curve.points.resize(1);
    CHECK(fault_of(curve) == "1 point is too few: a curve of degree 3 needs 4");
    curve = sound_cubic();
    curve.knots.pop_back();
    CHECK(fault_of(curve) == "8 knots are too few: 5 points of degree 3 need 9");
    curve = sound_cubic();
    curve.weights.pop_back();
    CHECK(fault_of(curve) == "4 weights for 5 points");
    curve = sound_cubic();
    curve.points[2].y() = std::numeric_limits<double>::quiet_NaN();
    CHECK(fault_of(curve) == "point 2 is not finite or is immensely far away");
    for (double weight : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
        curve = sound_cubic();
        curve.weights[3] = weight;
        CHECK(fault_of(curve).starts_with("weight 3 is "));
    }
    curve = sound_cubic();
    curve.weights[0] = 1e7;
    CHECK(fault_of(curve) == "the weights differ by more than a factor of a million");
    curve = sound_cubic();
    curve.knots[4] = 2;
    CHECK(fault_of(curve) == "the knots are not sorted: they decrease at knot 5 (1.000000)");
    curve = sound_cubic();
    curve.knots[4] = std::numeric_limits<double>::quiet_NaN();
    CHECK(fault_of(curve) == "knot 4 is not finite");
    curve = sound_cubic();
    curve.knots[4] = 0;
    CHECK(fault_of(curve) == "a knot stands more than 4 times at knot 4 (0.000000)");
    curve = sound_cubic();
    curve.points.resize(4);
    curve.weights.resize(4);
    curve.knots = {0, 0, 0, 1, 1, 2, 2, 2};
    CHECK(fault_of(curve) == "the knots leave no range in which the curve is defined");
}
