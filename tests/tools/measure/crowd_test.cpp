#include "tools/measure/crowd.h"

#include <catch2/catch.hpp>

#include <random>

using namespace keratin::measure;

TEST_CASE("neighbours are the near points of other strands") {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<std::uint32_t> first{0};
    std::vector<Point> position;
    for (int s = 0; s < 60; ++s) {
        for (int p = 0; p < 5; ++p)
            position.push_back({uniform(random), uniform(random), uniform(random)});
        first.push_back(static_cast<std::uint32_t>(position.size()));
    }
    std::vector<std::array<std::uint32_t, 2>> wanted;
    for (std::uint32_t a = 0; a < position.size(); ++a)
        for (std::uint32_t b = a + 1; b < position.size(); ++b)
            if (a / 5 != b / 5 && distance(position[a], position[b]) <= 0.2)
                wanted.push_back({a, b});
    REQUIRE(wanted.size() > 50);
    CHECK(neighbours({first, position}, 0.2) == wanted);
}

TEST_CASE("the relative speed of neighbours does not see what they move alike") {
    const std::vector<std::array<std::uint32_t, 2>> pairs{{0, 1}, {0, 2}};
    const std::vector<Point> velocity{{10, 0, 0}, {10, 3, 4}, {10, 0, 0}};
    CHECK(relative_speed(pairs, velocity) == Approx(2.5));
    CHECK(relative_speed({}, velocity) == 0);
}

TEST_CASE("mass on a grid is kept, and a crowd raises the high percentile") {
    std::vector<Point> position{{0.25, 0.5, 0.75}};
    const std::vector<double> mass{8.0};
    // One point of 8 kg between eight nodes of a grid of 2 m: no weight is lost.
    double sum = 0;
    for (double percentile = 0; percentile < 100.5; percentile += 100.0 / 7)
        sum += density_percentile(position, mass, 2, percentile);
    CHECK(sum * 8 == Approx(8));

    std::vector<Point> apart, together;
    std::vector<double> masses(64, 1.0);
    for (int i = 0; i < 64; ++i) {
        apart.push_back({static_cast<double>(i), 0.5, 0.5});
        together.push_back({i < 32 ? static_cast<double>(i) : 0.5, 0.5, 0.5});
    }
    CHECK(density_percentile(together, masses, 1, 99) >
          2 * density_percentile(apart, masses, 1, 99));
}
