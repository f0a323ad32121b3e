#include "tools/keratin-fit/fit_curve.h"

#include "bake/nurbs.h"
#include "bake/read/read_curves.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdio>
#include <numbers>

using namespace keratin;

namespace {

const std::string kData = KERATIN_DATA_DIR;

// Distance of a point from a curve, to the fineness of the sampling.
double distance(const Vec3& point, const std::vector<Vec3>& samples) {
    double nearest = (point - samples[0]).norm();
    for (std::size_t i = 1; i < samples.size(); ++i) {
        const Vec3 edge = samples[i] - samples[i - 1];
        const double t =
            std::clamp((point - samples[i - 1]).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (point - samples[i - 1] - t * edge).norm());
    }
    return nearest;
}

}  // namespace

TEST_CASE("a rational cubic follows a helix, clamped or not, and ends where it ends") {
    std::vector<Vec3> points;
    for (int i = 0; i <= 30; ++i) {
        const double angle = 2 * std::numbers::pi * i / 30;
        points.emplace_back(std::cos(angle), std::sin(angle), 0.3 * angle);
    }
    for (KnotEnds ends : {KnotEnds::clamped, KnotEnds::unclamped}) {
        const CurveFit fit = fit_rational_cubic(points, 9, ends);
        CHECK(fit.max_error < 3e-3);
        const auto nurbs =
            NurbsCurve::make(fit.curve.points, fit.curve.weights, fit.curve.knots, 3);
        REQUIRE(nurbs);
        CHECK((nurbs->position(0) - points.front()).norm() < 2e-3);
        CHECK((nurbs->position(1) - points.back()).norm() < 2e-3);
        const bool starts_on_a_point = (nurbs->position(0) - fit.curve.points[0]).norm() < 1e-9;
        CHECK(starts_on_a_point == (ends == KnotEnds::clamped));
    }
}

TEST_CASE("the NURBS groom in data stands where the strands it was fitted to stand") {
    const auto curves = read_curves(kData + "/nurbs/tail.obj");
    const auto strands = read_curves(kData + "/tressfx/tail.tfx");
    REQUIRE(curves);
    REQUIRE(strands);
    CHECK(curves->problems.empty());
    REQUIRE(curves->curves.size() == strands->curves.size());
    double largest = 0;
    std::size_t unclamped = 0, rational = 0;
    for (std::size_t s = 0; s < curves->curves.size(); ++s) {
        const RawCurve& curve = curves->curves[s];
        const auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, curve.degree);
        REQUIRE(nurbs);
        unclamped += curve.knots[0] < curve.knots[3];
        const auto [low, high] = std::minmax_element(curve.weights.begin(), curve.weights.end());
        rational += *high > 1.05 * *low;
        const auto samples = points_by_arc_length(*nurbs, curve.u_begin, curve.u_end, 400);
        for (const Vec3& point : strands->curves[s].points)
            largest = std::max(largest, distance(point, samples));
    }
    std::printf(
        "data/nurbs/tail.obj: %zu of %zu curves unclamped, %zu with unequal weights, "
        "largest distance %.3g\n",
        unclamped, curves->curves.size(), rational, largest);
    CHECK(unclamped == 63);
    CHECK(rational > 250);
    CHECK(largest < 0.05);
}
