#include "tests/data_dir.h"
#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>

#include <fstream>
#include <sstream>

using namespace keratin;
using namespace keratin::test;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Reference {
    double gamma, width, height;  // tip over length
};

std::vector<Reference> master_curve() {
    std::ifstream file(KERATIN_DATA_DIR "/validation/cantilever_master.csv");
    std::vector<Reference> rows;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        std::istringstream in(line);
        Reference r{};
        char comma;
        if (in >> r.gamma >> comma >> r.width >> comma >> r.height) rows.push_back(r);
    }
    return rows;
}

// A strand clamped horizontally, let go and settled; returns its tip over its free length. The
// first segment is carried, so the clamp stands at point 1.
std::array<double, 2> settled_tip(double gamma, std::uint32_t points, double rate,
                                  double e_scale = 1) {
    const double length = 0.1, segment = length / (points - 2), radius = 5e-5, density = 1300;
    scenes::GroomOptions options;
    Material& m = options.group.material;
    m.radius = m.radius2 = float(radius);
    m.density = float(density);
    const double weight = density * kPi * radius * radius * 9.81;
    m.youngs_modulus =
        float(e_scale * weight * std::pow(length, 3) / gamma / (kPi * std::pow(radius, 4) / 4));
    options.group.strand.damping = {0.3f};
    const scenes::Line line =
        scenes::straight_line({-segment, 0, 0}, {1, 0, 0}, length + segment, points);
    const scenes::Groom groom = scenes::make_groom({&line, 1}, options);
    Simulation s = made(groom, single_thread());
    run(s, 4, 1 / rate);
    const Point x = tip(s, 0);
    return {x[0] / length, -x[1] / length};
}

}  // namespace

TEST_CASE("the sag of a cantilever follows from its material") {
    const std::vector<Reference> curve = master_curve();
    REQUIRE(curve.size() > 60);
    double worst = 0;
    for (const Reference& r : curve) {
        if (r.gamma < 0.99 || r.gamma > 101) continue;
        const auto tip_now = settled_tip(r.gamma, 16, 60);
        const double error = std::hypot(tip_now[0] - r.width, tip_now[1] - r.height);
        INFO("Gamma " << r.gamma << ": " << tip_now[0] << ", " << tip_now[1] << ", error "
                      << error);
        CHECK(error < 0.03);
        worst = std::max(worst, error);
    }
    WARN("worst tip error for Gamma 1..100 at 16 points: " << worst << " of the length");
}

TEST_CASE("the effective Young's modulus is the given one") {
    // The E whose cantilever at Gamma = 1 sags as the exact one: found by bisection, as a user
    // would calibrate.
    double low = 0.5, high = 2;
    const double exact = 0.12347140;
    for (int i = 0; i < 12; ++i) {
        const double middle = 0.5 * (low + high);
        (settled_tip(1, 16, 60, middle)[1] > exact ? low : high) = middle;
    }
    WARN("calibrated E over given E at Gamma 1, 16 points: " << low);
    CHECK(low == Approx(1).epsilon(0.03));
}

TEST_CASE("the sag does not depend on the frame rate") {
    for (double gamma : {1.0, 30.0}) {
        const auto reference = settled_tip(gamma, 16, 60);
        for (double rate : {30.0, 120.0, 240.0}) {
            const auto now = settled_tip(gamma, 16, rate);
            const double moved = 0.1 * std::hypot(now[0] - reference[0], now[1] - reference[1]);
            INFO("Gamma " << gamma << " at " << rate << " Hz: " << moved << " m");
            CHECK(moved < 0.0005);
        }
    }
}

TEST_CASE("the sag converges with the number of points") {
    const Reference exact{10, 0.65635376, 0.70019972};
    double before = 1;
    for (std::uint32_t points : {6u, 10u, 18u, 32u}) {
        const auto now = settled_tip(10, points, 60);
        const double error = std::hypot(now[0] - exact.width, now[1] - exact.height);
        INFO(points << " points: " << error);
        CHECK(error < 0.8 * before);
        before = error;
    }
    CHECK(before < 0.01);
}

TEST_CASE("a strand sags as it would alone, whatever the longer ones of its tile") {
    std::vector<scenes::Line> lines;
    for (const std::uint32_t points : {3u, 9u, 32u})
        lines.push_back(scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.04, points));
    const scenes::Groom tile = scenes::make_groom(lines, {});
    Simulation all = made(tile, single_thread());
    run(all, 2, 1.0 / 60);
    for (std::uint32_t k = 0; k < lines.size(); ++k) {
        const scenes::Groom one = scenes::make_groom({&lines[k], 1}, {});
        Simulation alone = made(one, single_thread());
        run(alone, 2, 1.0 / 60);
        INFO(lines[k].size() << " points: " << tip(all, k)[1] << " m, alone " << tip(alone, 0)[1]);
        CHECK(tip(alone, 0)[1] < -5e-4);
        CHECK(distance(tip(all, k), tip(alone, 0)) < 1e-7);
    }
}
