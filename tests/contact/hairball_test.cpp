// The hairball's free fall against the published program's (data/hairball/README.md).
#include "tests/data_dir.h"
#include "tools/scenes/contact_scenes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

using namespace keratin;
using namespace keratin::scenes;

TEST_CASE("the hairball falls as in the published program") {
    std::ifstream file(KERATIN_DATA_DIR "/hairball/hairball_t0.05.csv");
    REQUIRE(file.good());
    std::vector<std::vector<Double3>> reference;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        unsigned s = 0, v = 0;
        double x = 0, y = 0, z = 0;
        REQUIRE(std::sscanf(line.c_str(), "%u,%u,%lf,%lf,%lf", &s, &v, &x, &y, &z) == 5);
        reference.resize(std::max<std::size_t>(reference.size(), s + 1));
        reference[s].push_back({x / 100, y / 100, z / 100});  // cm
    }
    REQUIRE(reference.size() == 40);

    const ContactScene like = hairball({1, 40, true});
    std::vector<RodStrand> strands;
    for (const std::vector<Double3>& at : reference) {
        RodStrand s = like.strands[0];
        const Double3& root = at[0];
        const double radius = std::hypot(root[0], root[1], root[2]);
        for (std::size_t i = 0; i < s.points.size(); ++i) {
            const double k = (0.15 + 0.2 * static_cast<double>(i) / 39) / radius;
            s.points[i] = {k * root[0], k * root[1], k * root[2]};
        }
        strands.push_back(s);
    }
    Result<RodSimulation> rods = RodSimulation::create(strands, like.rod);
    REQUIRE(rods);
    for (int k = 0; k < 50; ++k) REQUIRE(rods->step(like.step));
    double worst = 0, fall = 0;
    for (std::size_t s = 0; s < strands.size(); ++s)
        for (std::size_t i = 0; i < 40; ++i) {
            const Double3 p = rods->position(s, i), &q = reference[s][i], &o = strands[s].points[i];
            worst = std::max(worst, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
            fall = std::max(fall, std::hypot(q[0] - o[0], q[1] - o[1], q[2] - o[2]));
        }
    INFO("farthest " << worst << " m from the reference, which moved by " << fall << " m");
    CHECK(fall > 0.01);
    CHECK(worst < 1e-4);  // 1.7e-5; their springs and Newton's tolerance
}
