#include "runtime/contact/advance.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <optional>
#include <random>
#include <vector>

using namespace keratin;

namespace {

double triple(const Vector3& a, const Vector3& b, const Vector3& c) { return dot(a, cross(b, c)); }

// The earliest time in 0..1 at which the centre lines cross, by the cubic that says when the four
// end points are coplanar; the roots by bisection between the extrema.
std::optional<double> crossing_by_cubic(const MovingSegment& p, const MovingSegment& q) {
    const Vector3 e = p.b - p.a, f = q.b - q.a, w = q.a - p.a;
    const Vector3 de = p.move_b - p.move_a, df = q.move_b - q.move_a, dw = q.move_a - p.move_a;
    auto value = [&](double t) { return triple(e + de * t, f + df * t, w + dw * t); };
    const double c3 = triple(de, df, dw),
                 c2 = triple(e, df, dw) + triple(de, f, dw) + triple(de, df, w),
                 c1 = triple(e, f, dw) + triple(e, df, w) + triple(de, f, w);
    std::vector<double> ends{0};
    const double discriminant = 4 * c2 * c2 - 12 * c3 * c1;
    if (discriminant >= 0)
        for (const double sign : {-1.0, 1.0}) {
            const double root =
                c3 != 0 ? (-2 * c2 + sign * std::sqrt(discriminant)) / (6 * c3) : -c1 / (2 * c2);
            if (root > 0 && root < 1) ends.push_back(root);
        }
    ends.push_back(1);
    std::sort(ends.begin(), ends.end());
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
        double low = ends[i], high = ends[i + 1];
        if ((value(low) > 0) == (value(high) > 0)) continue;
        for (int k = 0; k < 80; ++k) {
            const double mid = 0.5 * (low + high);
            ((value(mid) > 0) == (value(low) > 0) ? low : high) = mid;
        }
        const MovingSegment pt = at_time(p, low), qt = at_time(q, low);
        if (closest_segments(pt.a, pt.b, qt.a, qt.b).squared_distance < 1e-16) return low;
    }
    return std::nullopt;
}

MovingSegment random_segment(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    auto vector = [&] { return Vector3{unit(random), unit(random), unit(random)}; };
    return {vector(), vector(), vector(), vector()};
}

double distance_at(const MovingSegment& p, const MovingSegment& q, double t) {
    const MovingSegment pt = at_time(p, t), qt = at_time(q, t);
    return std::sqrt(closest_segments(pt.a, pt.b, qt.a, qt.b).squared_distance);
}

}  // namespace

TEST_CASE("thin segments meet just before the coplanarity cubic says that their lines cross") {
    std::mt19937 random(5);
    const double delta = 1e-4;
    int crossings = 0, undecided = 0;
    for (int i = 0; i < 4000; ++i) {
        const MovingSegment p = random_segment(random), q = random_segment(random);
        const std::optional<double> cubic = crossing_by_cubic(p, q);
        if (!cubic || distance_at(p, q, 0) < 0.01) continue;
        ++crossings;
        const FirstContact first = first_segment_contact(p, q, delta);
        REQUIRE(first.found);
        CHECK(first.time <= *cubic);
        if (distance_at(p, q, first.time) > 1.002 * delta) ++undecided;
    }
    CHECK(crossings > 300);
    CHECK(undecided < crossings / 50);
}

TEST_CASE("the first contact is never after the distance first falls to delta") {
    std::mt19937 random(9);
    const double delta = 0.05;
    int met = 0, undecided = 0;
    for (int i = 0; i < 1000; ++i) {
        const MovingSegment p = random_segment(random), q = random_segment(random);
        double sampled = 2;
        for (int k = 0; k <= 2000 && sampled > 1; ++k)
            if (distance_at(p, q, k / 2000.0) <= delta) sampled = k / 2000.0;
        const FirstContact first = first_segment_contact(p, q, delta);
        if (sampled <= 1) {
            ++met;
            REQUIRE(first.found);
            CHECK(first.time <= sampled);
        }
        if (first.found && distance_at(p, q, first.time) > delta * 1.0011) ++undecided;  // grazing
    }
    CHECK(met > 100);
    CHECK(undecided < 10);
}

TEST_CASE("segments that move together never come nearer however fast") {
    const MovingSegment p{{0, 0, 0}, {1, 0, 0}, {1000, 0, 0}, {1000, 0, 0}};
    const MovingSegment q{{0, 0.011, 0}, {1, 0.011, 0}, {1000, 0, 0}, {1000, 0, 0}};
    CHECK_FALSE(first_segment_contact(p, q, 0.01).found);
}

TEST_CASE("parallel segments are no special case") {
    const MovingSegment p{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    const MovingSegment q{{0.5, 1, 0}, {1.5, 1, 0}, {0, -2, 0}, {0, -2, 0}};
    const FirstContact first = first_segment_contact(p, q, 0.1);
    REQUIRE(first.found);
    CHECK(first.time == Approx(0.45).margin(1e-4));
}

TEST_CASE("closest points of a point and a triangle agree with a search over the triangle") {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int i = 0; i < 200; ++i) {
        auto vector = [&] { return Vector3{unit(random), unit(random), unit(random)}; };
        const Vector3 p = vector(), a = vector(), b = vector(), c = vector();
        double least = 1e9;
        for (int u = 0; u <= 60; ++u)
            for (int v = 0; u + v <= 60; ++v)
                least =
                    std::min(least, length(p - (a + (u / 60.0) * (b - a) + (v / 60.0) * (c - a))));
        const double d = std::sqrt(closest_on_triangle(p, a, b, c).squared_distance);
        CHECK(d <= least + 1e-12);
        CHECK(d > least - 0.05);
    }
}
