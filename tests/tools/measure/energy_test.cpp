#include "tools/measure/energy.h"

#include <catch2/catch.hpp>

using namespace keratin::measure;

namespace {

// A straight strand of unit length along x, and the same bent to an arc of curvature k in the
// plane of x and y.
std::vector<Point> arc(std::size_t segments, double k) {
    std::vector<Point> out{{0, 0, 0}};
    const double l = 1.0 / static_cast<double>(segments);
    for (std::size_t i = 0; i < segments; ++i) {
        const double angle = k * l * static_cast<double>(i);
        out.push_back(out.back() + Point{l * std::cos(angle), l * std::sin(angle), 0});
    }
    return out;
}

}  // namespace

TEST_CASE("half of each segment's mass goes to either end") {
    const std::vector<std::uint32_t> first{0, 3};
    const std::vector<Point> rest{{0, 0, 0}, {1, 0, 0}, {4, 0, 0}};
    const std::vector<double> line_density{2};
    CHECK(lumped_masses({first, rest}, line_density) == std::vector<double>{1, 4, 3});
}

TEST_CASE("kinetic, potential and stretch energy follow their formulas") {
    const std::vector<double> mass{1, 2};
    const std::vector<Point> velocity{{3, 4, 0}, {0, 0, 1}};
    CHECK(kinetic_energy(mass, velocity) == Approx(12.5 + 1));
    const std::vector<Point> position{{0, 1, 0}, {0, 2, 0}};
    CHECK(potential_energy(mass, position, {0, -10, 0}) == Approx(50));
    const std::vector<std::uint32_t> first{0, 2};
    const std::vector<Point> rest{{0, 0, 0}, {2, 0, 0}}, now{{0, 0, 0}, {2.2, 0, 0}};
    const std::vector<double> stiffness{100};
    CHECK(stretch_energy({first, now}, {first, rest}, stiffness) == Approx(0.5 * 100 * 0.01 * 2));
}

TEST_CASE("a strand bent to an arc holds the energy EI k^2 L / 2") {
    const double k = 1.5, stiffness = 3;
    const std::vector<double> stiffnesses{stiffness};
    for (const std::size_t n : {64u, 128u}) {
        const std::vector<std::uint32_t> first{0, static_cast<std::uint32_t>(n + 1)};
        const auto rest = arc(n, 0), now = arc(n, k);
        const std::vector<Rigid> root(1);
        const double energy = bend_energy({first, now}, {first, rest}, root, stiffnesses);
        // The n - 1 joints span the arc without half a segment at either end.
        const double joints = 1 - 1.0 / static_cast<double>(n);
        INFO(n);
        CHECK(energy == Approx(0.5 * stiffness * k * k * joints).epsilon(1e-3));
    }
}

TEST_CASE("a strand carried rigidly holds no elastic energy, whatever its rest shape") {
    const std::vector<std::uint32_t> first{0, 21};
    const auto rest = arc(20, 3);
    const double half = std::sqrt(0.5);
    const std::vector<Rigid> root{{{1, 2, 3}, half, 0, 0, half}};
    std::vector<Point> now;
    for (const Point& p : rest) now.push_back(apply(root[0], p));
    const std::vector<double> stiffness{3};
    CHECK(bend_energy({first, now}, {first, rest}, root, stiffness) < 1e-25);
    CHECK(bend_energy({first, arc(20, 0)}, {first, rest}, {std::vector<Rigid>(1)}, stiffness) > 1);
}
