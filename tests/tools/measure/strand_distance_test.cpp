#include "tools/measure/strand_distance.h"

#include <catch2/catch.hpp>

#include <random>
#include <vector>

using namespace keratin::measure;

TEST_CASE("the distance of segments is the least over sampled points") {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int i = 0; i < 300; ++i) {
        auto point = [&] { return Point{unit(random), unit(random), unit(random)}; };
        const Point a0 = point(), a1 = point(), b0 = point(),
                    b1 = i % 5 == 0 ? b0 + (a1 - a0) : point();
        double least = 1e9;
        for (int s = 0; s <= 100; ++s)
            for (int t = 0; t <= 100; ++t)
                least = std::min(
                    least, distance(a0 + (a1 - a0) * (s / 100.0), b0 + (b1 - b0) * (t / 100.0)));
        const double d = segment_distance(a0, a1, b0, b1);
        CHECK(d <= least + 1e-12);
        CHECK(d > least - 0.03);
    }
}

TEST_CASE("overlaps are found between strands and along one, but not between neighbours") {
    const double r = 1e-3;
    const std::vector<Point> p{
        {0, 0, 0},           {0.1, 0, 0},
        {0.1, 0.1, 0},       {0.05, -0.1, 1.5e-3},  // crosses itself
        {-0.1, 0.0, 1.9e-3}, {0.2, 0.0, 1.9e-3}};   // lies along its first edge
    const std::vector<std::uint32_t> first{0, 4, 6};
    const std::vector<double> radius{r, r};
    const Overlap self =
        overlap_between({std::span(first).first(2), std::span(p).first(4)}, radius, 0, 0);
    CHECK(self.pairs == 1);
    CHECK(self.first == 0);
    CHECK(self.second == 2);
    const Overlap all = overlap_between({first, p}, radius, 0, 0);
    CHECK(all.pairs == 4);
    CHECK(overlap_between({first, p}, radius, 1e-4, 0).pairs == 0);
}

TEST_CASE("an edge that cuts through a capsule between its ends overlaps it") {
    const std::vector<Point> p{{-1, 0.099, 0}, {1, 0.099, 0}};
    const std::vector<std::uint32_t> first{0, 2};
    const std::vector<double> radius{1e-3};
    const Overlap o =
        overlap_with({first, p}, radius, Capsule{{0, 0, -1}, {0, 0, 1}, 0.1}, 0, 0, 0);
    CHECK(o.depth == Approx(2e-3).epsilon(1e-6));
    CHECK(overlap_with({first, p}, radius, Capsule{{0, 0, -1}, {0, 0, 1}, 0.1}, 0, 0, 1).pairs ==
          0);
}
