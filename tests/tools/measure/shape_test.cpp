#include "tools/measure/shape.h"

#include "tools/measure/solid.h"

#include <catch2/catch.hpp>

using namespace keratin::measure;

namespace {

const std::vector<std::uint32_t> kFirst{0, 3, 5};
const std::vector<Point> kRest{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 1}, {0, 2, 1}};

}  // namespace

TEST_CASE("stretch is the largest relative change of a segment, longer or shorter") {
    std::vector<Point> now = kRest;
    CHECK(stretch({kFirst, now}, {kFirst, kRest}).max == 0);
    now[2].x = 1.9;   // shorter by 10 %
    now[4].y = 2.06;  // longer by 3 %
    const Spread spread = stretch({kFirst, now}, {kFirst, kRest});
    CHECK(spread.max == Approx(0.1));
    CHECK(spread.mean == Approx(0.13 / 3));
}

TEST_CASE("the tips of a groom that moves rigidly do not lag; a tip left behind does") {
    std::vector<Point> now = kRest;
    CHECK(tip_lag({kFirst, now}, {kFirst, kRest}).max == 0);
    now[1].y = 5;  // not a tip
    CHECK(tip_lag({kFirst, now}, {kFirst, kRest}).max == 0);
    now[4] = {0, 2, 1.02};
    CHECK(tip_lag({kFirst, now}, {kFirst, kRest}).max == Approx(0.02));
    CHECK(tip_lag({kFirst, now}, {kFirst, kRest}).mean == Approx(0.01));
}

TEST_CASE("points are compared one by one") {
    const std::vector<Point> a{{0, 0, 0}, {1, 1, 1}}, b{{0, 3, 4}, {1, 1, 1}};
    CHECK(point_distance(a, b).max == 5);
    CHECK(point_distance(a, b).mean == 2.5);
}

TEST_CASE("a rigid motion turns and moves, and its inverse brings back") {
    const double half = std::sqrt(0.5);
    const Rigid quarter{{1, 2, 3}, 0, half, 0, half};  // a quarter turn about y
    const Point p = apply(quarter, {1, 0, 0});
    CHECK(distance(p, {1, 2, 2}) < 1e-15);
    CHECK(distance(apply_inverse(quarter, p), {1, 0, 0}) < 1e-15);
}

TEST_CASE("solids measure the distance to their surface, negative inside") {
    CHECK(signed_distance(Plane{{0, 1, 0}, {0, 2, 0}}, {5, 3, 5}) == Approx(2));
    CHECK(signed_distance(Plane{{0, 1, 0}, {0, 2, 0}}, {5, 0, 5}) == Approx(-1));
    const Capsule sphere{{1, 0, 0}, {1, 0, 0}, 2};
    CHECK(signed_distance(sphere, {1, 0, 0}) == Approx(-2));
    CHECK(signed_distance(sphere, {1, 3, 4}) == Approx(3));
    const Capsule capsule{{0, 0, 0}, {2, 0, 0}, 0.5};
    CHECK(signed_distance(capsule, {1, 1, 0}) == Approx(0.5));
    CHECK(signed_distance(capsule, {-1, 0, 0}) == Approx(0.5));
    CHECK(signed_distance(capsule, {1, 0.1, 0}) == Approx(-0.4));
    const Box box{{0, 0, 0}, {1, 2, 3}};
    CHECK(signed_distance(box, {0, 0, 0}) == Approx(-1));
    CHECK(signed_distance(box, {4, 6, 0}) == Approx(5));
    CHECK(signed_distance(Solid(box), {0, 1.5, 0}) == Approx(-0.5));
}
