#include "runtime/rod/rod_simulation.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

using namespace keratin;

namespace {

RodStrand straight(std::size_t edges, double length, Double3 direction = {1, 0, 0}, Double3 root = {0, 0, 0}) {
    RodStrand s;
    for (std::size_t i = 0; i <= edges; ++i) {
        const double d = length * static_cast<double>(i) / static_cast<double>(edges);
        s.points.push_back({root[0] + d * direction[0], root[1] + d * direction[1], root[2] + d * direction[2]});
    }
    s.material.youngs_modulus = 3e9;
    s.material.poisson_ratio = 0.35;
    return s;
}

// Strands of different lengths, curls and ends.
std::vector<RodStrand> assorted(std::size_t count) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> in(-1, 1);
    std::vector<RodStrand> strands;
    for (std::size_t s = 0; s < count; ++s) {
        RodStrand a = straight(4 + s % 5, 0.05 + 0.01 * static_cast<double>(s % 3), {0.8, 0, 0.6}, {in(random), in(random), in(random)});
        a.natural_curvature = {{20 * in(random), 30 * in(random)}};
        a.natural_twist = 10 * in(random);
        a.material.radii = {6e-5, 4e-5};
        a.material.viscosity = s % 2 ? 1e5 : 0;
        a.root = s % 4 == 3 ? RodEnd::pinned : RodEnd::clamped;
        strands.push_back(a);
    }
    return strands;
}

// The same, clamped and almost straight: they fall without whipping.
std::vector<RodStrand> calm(std::size_t count) {
    auto strands = assorted(count);
    for (RodStrand& s : strands) {
        s.natural_curvature = {{1, -2}};
        s.root = RodEnd::clamped;
    }
    return strands;
}

RodSimulation make(std::span<const RodStrand> strands, const RodSettings& settings) {
    auto r = RodSimulation::create(strands, settings);
    REQUIRE(r);
    return std::move(*r);
}

bool same_bits(std::span<const double> a, std::span<const double> b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

}  // namespace

TEST_CASE("a free strand falls as implicit Euler falls") {
    RodStrand s = straight(12, 0.1, {0.6, 0.8, 0});
    s.root = RodEnd::free;
    RodSimulation rods = make(std::span(&s, 1), {});
    const double h = 1e-3;
    for (int k = 0; k < 100; ++k) REQUIRE(rods.step(h));
    const double fall = 0.5 * 9.81 * 0.1 * 0.1 * (1 + h / 0.1);
    for (std::size_t i = 0; i <= 12; ++i) {
        const Double3 p = rods.position(0, i);
        CHECK(std::abs(p[1] - (s.points[i][1] - fall)) < 1e-12);
        CHECK(std::abs(p[0] - s.points[i][0]) < 1e-12);
    }
}

TEST_CASE("a spinning free strand keeps its momentum and its centre") {
    RodStrand s = straight(10, 0.1);
    s.root = RodEnd::free;
    for (const Double3& p : s.points) s.velocities.push_back({0, 20 * (p[0] - 0.05), 0.3});
    RodSettings settings;
    settings.gravity = {0, 0, 0};
    settings.tolerance = 1e-12;
    RodSimulation rods = make(std::span(&s, 1), settings);
    for (int k = 0; k < 50; ++k) REQUIRE(rods.step(1e-3));
    Double3 momentum{};
    double mass = 0;
    for (std::size_t i = 0; i <= 10; ++i) {
        const double m = rods.vertex_mass(0, i);
        const Double3 v = rods.velocity(0, i);
        mass += m;
        for (std::size_t c = 0; c < 3; ++c) momentum[c] += m * v[c];
    }
    CHECK(std::abs(momentum[0]) < 1e-10 * mass);
    CHECK(std::abs(momentum[1]) < 1e-10 * mass);
    CHECK(std::abs(momentum[2] - 0.3 * mass) < 1e-10 * mass);
}

TEST_CASE("viscosity does not resist a rigid motion") {
    RodStrand s = straight(8, 0.1);
    s.root = RodEnd::free;
    for (const Double3& p : s.points) s.velocities.push_back({0, 5 * (p[0] - 0.05), 0});
    RodSettings settings;
    settings.gravity = {0, 0, 0};
    RodSimulation plain = make(std::span(&s, 1), settings);
    s.material.viscosity = 1e6;
    RodSimulation viscous = make(std::span(&s, 1), settings);
    for (int k = 0; k < 20; ++k) {
        REQUIRE(plain.step(1e-4));
        REQUIRE(viscous.step(1e-4));
    }
    const Double3 a = plain.velocity(0, 8), b = viscous.velocity(0, 8);
    CHECK(std::abs(a[1] - b[1]) < 1e-3 * std::abs(a[1]));
}

TEST_CASE("viscosity slows the fall of a clamped strand") {
    RodStrand s = straight(10, 0.1);
    RodSimulation plain = make(std::span(&s, 1), {});
    s.material.viscosity = 1e9;
    RodSimulation viscous = make(std::span(&s, 1), {});
    for (int k = 0; k < 50; ++k) {
        REQUIRE(plain.step(1e-3));
        REQUIRE(viscous.step(1e-3));
    }
    CHECK(viscous.position(0, 10)[1] > 0.5 * plain.position(0, 10)[1]);
    CHECK(viscous.position(0, 10)[1] < 0);
}

TEST_CASE("drag brings a falling strand to its terminal speed") {
    RodStrand s = straight(4, 0.02);
    s.root = RodEnd::free;
    s.material.air_drag = 1e-3;
    RodSimulation rods = make(std::span(&s, 1), {});
    for (int k = 0; k < 200; ++k) REQUIRE(rods.step(5e-3));
    const double weight = 1300 * 3.14159265358979 * 5e-5 * 5e-5 * 9.81;  // N/m
    CHECK(rods.velocity(0, 2)[1] == Approx(-weight / 1e-3).epsilon(1e-9));
}

TEST_CASE("the result does not depend on the number of threads") {
    const auto strands = assorted(40);
    RodSettings one, three;
    one.threads = 1;
    three.threads = 3;
    RodSimulation a = make(strands, one), b = make(strands, three);
    for (int k = 0; k < 10; ++k) {
        REQUIRE(a.step(2e-3));
        REQUIRE(b.step(2e-3));
    }
    CHECK(same_bits(a.numbers(), b.numbers()));
    CHECK(same_bits(a.rates(), b.rates()));
}

TEST_CASE("a strand moves in the same way alone and among others") {
    const auto strands = assorted(21);
    RodSimulation all = make(strands, {});
    for (int k = 0; k < 10; ++k) REQUIRE(all.step(4e-3));
    for (const std::size_t s : {0u, 7u, 20u}) {
        // positions count from the first strand's root, so it comes along
        const RodStrand pair[] = {strands[0], strands[s]};
        RodSimulation alone = make(pair, {});
        for (int k = 0; k < 10; ++k) REQUIRE(alone.step(4e-3));
        for (std::size_t i = 0; i < strands[s].points.size(); ++i) CHECK(alone.position(1, i) == all.position(s, i));
    }
}

TEST_CASE("every instruction set gives the same motion to the tolerance") {
    const auto strands = calm(11);
    RodSettings settings;
    settings.tolerance = 1e-10;
    settings.instruction_set = InstructionSet::baseline;
    RodSimulation reference = make(strands, settings);
    for (int k = 0; k < 5; ++k) REQUIRE(reference.step(2e-3));
    for (const InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
        settings.instruction_set = set;
        RodSimulation rods = make(strands, settings);
        for (int k = 0; k < 5; ++k) REQUIRE(rods.step(2e-3));
        double worst = 0;
        for (std::size_t s = 0; s < strands.size(); ++s)
            for (std::size_t i = 0; i < strands[s].points.size(); ++i)
                for (std::size_t c = 0; c < 3; ++c)
                    worst = std::max(worst, std::abs(rods.position(s, i)[c] - reference.position(s, i)[c]));
        CHECK(worst < 1e-9);
    }
}

TEST_CASE("a restored simulation continues bit by bit") {
    const auto strands = assorted(9);
    RodSimulation a = make(strands, {}), b = make(strands, {});
    for (int k = 0; k < 5; ++k) REQUIRE(a.step(2e-3));
    REQUIRE(b.restore(a.save()));
    for (int k = 0; k < 5; ++k) {
        REQUIRE(a.step(2e-3));
        REQUIRE(b.step(2e-3));
    }
    CHECK(same_bits(a.numbers(), b.numbers()));
    CHECK(a.time() == b.time());
    auto bytes = a.save();
    bytes.pop_back();
    CHECK(!b.restore(bytes));
}

TEST_CASE("a state with directors that no simulation has is refused") {
    RodSimulation rods = make(assorted(2), {});
    const auto state = rods.save();
    // Numbers of the state times 3, one at a time: x, v and the frames of a straight start hold
    // numbers of any size, but a director three times as long is none.
    std::size_t refused = 0;
    for (std::size_t at = 0; at + sizeof(double) <= state.size(); at += sizeof(double)) {
        auto changed = state;
        double number;
        std::memcpy(&number, changed.data() + at, sizeof number);
        if (!(std::fabs(number) > 0.9 && std::fabs(number) <= 1)) continue;
        number *= 3;
        std::memcpy(changed.data() + at, &number, sizeof number);
        const auto result = rods.restore(changed);
        if (result) continue;
        ++refused;
        CHECK_THAT(to_string(result.error()), Catch::Contains("frames that no simulation has"));
    }
    CHECK(refused > 0);
    CHECK(rods.restore(state));
}

TEST_CASE("full and quasi Newton find the same step") {
    const auto strands = calm(8);
    RodSettings quasi, full;
    full.newton = RodNewton::full;
    quasi.tolerance = full.tolerance = 1e-10;
    RodSimulation a = make(strands, quasi), b = make(strands, full);
    for (int k = 0; k < 5; ++k) {
        const auto ra = a.step(2e-3), rb = b.step(2e-3);
        REQUIRE(ra);
        REQUIRE(rb);
        CHECK(ra->at_cap == 0);
        CHECK(rb->most_iterations <= 8);
    }
    for (std::size_t s = 0; s < strands.size(); ++s)
        for (std::size_t c = 0; c < 3; ++c)
            CHECK(std::abs(a.position(s, 3)[c] - b.position(s, 3)[c]) < 1e-8);
}

TEST_CASE("a clamped root follows its target and turns the strand with it") {
    for (const RodEnd end : {RodEnd::clamped, RodEnd::clamped_two_points}) {
        RodStrand s = straight(6, 0.03);
        s.root = end;
        RodSettings settings;
        settings.gravity = {0, 0, 0};
        RodSimulation rods = make(std::span(&s, 1), settings);
        // three turns about the strand's own axis, then a quarter about y, much larger than a step may be
        REQUIRE(rods.move_root(0, {.position = {0.01, 0, 0}, .turn = {6 * 3.14159265358979, 0, 0}}));
        REQUIRE(rods.step(0.01));
        REQUIRE(rods.move_root(0, {.position = {0.01, 0.02, 0}, .turn = {0, 3.14159265358979 / 2, 0}}));
        REQUIRE(rods.step(0.01));
        CHECK(rods.position(0, 0) == Double3{0.01, 0.02, 0});
        REQUIRE(rods.settle({}).settled);
        const Double3 tip = rods.position(0, 6);
        CHECK(tip[0] == Approx(0.01).margin(1e-9));
        CHECK(tip[1] == Approx(0.02).margin(1e-9));
        CHECK(tip[2] == Approx(-0.03).margin(1e-9));
        CHECK(std::abs(rods.twist(0)) < 1e-6);
    }
}

TEST_CASE("twist of a strand clamped at both ends is counted over many turns") {
    RodStrand s = straight(10, 0.05);
    s.tip = RodEnd::clamped;
    s.material.youngs_modulus = 1e12;  // far below the twist at which it would buckle
    RodSettings settings;
    settings.gravity = {0, 0, 0};
    RodSimulation rods = make(std::span(&s, 1), settings);
    for (int k = 0; k < 20; ++k) {
        REQUIRE(rods.move_tip(0, {.position = {0.05, 0, 0}, .turn = {0.2, 0, 0}}));
        REQUIRE(rods.step(1e-2));
    }
    CHECK(rods.twist(0) == Approx(4.0).epsilon(1e-9));
}

TEST_CASE("input that cannot be used is refused and named") {
    const RodStrand good = straight(5, 0.05);
    const auto refused = [&](auto change, const char* where) {
        RodStrand s = good;
        change(s);
        const RodStrand two[] = {good, s};
        const auto r = RodSimulation::create(two, {});
        REQUIRE(!r);
        CHECK(r.error().code == ErrorCode::input);
        CHECK(r.error().where == std::string("strands[1]") + where);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    refused([&](RodStrand& s) { s.points[3][1] = nan; }, ".points[3]");
    refused([&](RodStrand& s) { s.points[3] = s.points[2]; }, ".points[3]");
    refused([&](RodStrand& s) { s.points.clear(); }, ".points");
    refused([&](RodStrand& s) { s.points.resize(1); }, ".points");
    refused([&](RodStrand& s) { s.material.radii[0] = -1e-5; }, ".radii");
    refused([&](RodStrand& s) { s.material.density = 0; }, ".density");
    refused([&](RodStrand& s) { s.material.poisson_ratio = 0.6; }, ".poisson_ratio");
    refused([&](RodStrand& s) { s.root_frame.tangent = Double3{0, 0, 0}; }, ".root_direction");
    refused([&](RodStrand& s) { s.rest_points = {{0, 0, 0}}; }, ".rest_points");
    RodSimulation rods = make(std::span(&good, 1), {});
    const std::vector<double> before(rods.numbers().begin(), rods.numbers().end());
    CHECK(!rods.step(0));
    CHECK(!rods.step(-1e-3));
    CHECK(!rods.move_root(0, {.position = {nan, 0, 0}}));
    CHECK(!rods.move_tip(0, {.position = {0, 0, 0}}));
    CHECK(!rods.set_force(0, 9, {0, 0, 0}));
    CHECK(same_bits(before, rods.numbers()));
}

TEST_CASE("a strand that stops being finite is lost once a step and lets the others be") {
    const std::vector<RodStrand> three(3, straight(5, 0.05));
    RodSimulation rods = make(three, {}), two = make(std::span(three).first(2), {});
    const_cast<double&>(rods.numbers()[rods.layout().index(2, 3, 1)]) = std::nan("");
    for (int k = 0; k < 3; ++k) {
        CHECK(rods.step(1e-3)->lost == 1);
        CHECK(two.step(1e-3)->lost == 0);
        CHECK(rods.points(1) == two.points(1));
    }
}

TEST_CASE("a curved strand is about its rest shape as stiff as the elastica, to order two") {
    // Castigliano: a quarter circle clamped at one end, pulled at the other along the clamp's tangent,
    // gives way by pi/4 P R^3/EI
    const double radius = 0.05, pull = 1e-10, pi = 3.14159265358979323846;
    double errors[2], beside[2];
    for (const std::size_t edges : {10, 20}) {
        RodStrand s = straight(edges, radius * pi / 2);
        s.natural_curvature = {{0, 1 / radius}};
        s.root_frame = {Double3{1, 0, 0}, Double3{0, 0, 1}};
        RodSettings settings;
        settings.gravity = {0, 0, 0};
        RodSimulation rods = make({&s, 1}, settings);
        REQUIRE(rods.settle({.tolerance = 1e-12}).settled);
        const Double3 before = rods.position(0, edges);
        REQUIRE(rods.set_force(0, edges, {pull, 0, 0}));
        REQUIRE(rods.settle({.tolerance = 1e-12}).settled);
        const double r = s.material.radii[0];
        const double stiffness = s.material.youngs_modulus * pi * r * r * r * r / 4;
        const double expected = pi / 4 * pull * radius * radius * radius / stiffness;
        const double measured = (rods.position(0, edges)[0] - before[0]) / expected;
        errors[edges / 20] = std::fabs(measured - 1);
        // what a joint that rests bent by phi is stiffer: (phi/omega)^2 (1 + omega^2/4)^2
        const double phi = pi / 2 / static_cast<double>(edges);
        const double stiffer = std::pow(phi / std::sin(phi), 2);
        beside[edges / 20] = std::fabs(measured * stiffer - 1);
    }
    CAPTURE(errors[0], errors[1], beside[0], beside[1]);
    CHECK(beside[0] < 4e-3);
    CHECK(errors[1] < errors[0] / 3.5);
}

TEST_CASE("to straighten a curl takes the material's work, whatever its edges turn by") {
    const double length = 0.1, curvature = 80, pi = 3.14159265358979323846;
    for (const std::size_t edges : {10, 20, 80}) {
        RodStrand s = straight(edges, length);
        s.natural_curvature = {{0.6 * curvature, 0.8 * curvature}};
        const RodSimulation rods = make({&s, 1}, {});
        const double r = s.material.radii[0];
        const double stiffness = s.material.youngs_modulus * pi * r * r * r * r / 4;
        // joints stand for all but the last half edge
        const double bent = length * (1 - 0.5 / static_cast<double>(edges));
        CHECK(rods.energy(0).bend == Approx(stiffness / 2 * curvature * curvature * bent).epsilon(1e-12));
    }
}

TEST_CASE("the midpoint rule keeps a swing's energy and is of order two") {
    const auto swing = [](double h, RodIntegrator integrator, double& loss) {
        RodStrand s = straight(4, 0.1);
        s.root = RodEnd::pinned;
        RodSettings settings;
        settings.integrator = integrator;
        settings.bend_scale = 1e4;
        RodSimulation rods = make({&s, 1}, settings);
        const auto energy = [&] {
            const RodEnergy e = rods.energy(0);
            return e.kinetic + e.elastic() + e.potential;
        };
        const double before = energy(), scale = 0.1 * 9.81 * 4 * rods.vertex_mass(0, 1);
        while (rods.time() < 0.2 - h / 2) REQUIRE(rods.step(h));
        loss = std::fabs(energy() - before) / scale;
        return rods.position(0, 4);
    };
    const auto apart = [](const Double3& a, const Double3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); };
    double loss = 0, euler_loss = 0, ignored = 0;
    const Double3 coarse = swing(2e-3, RodIntegrator::midpoint, ignored), fine = swing(1e-3, RodIntegrator::midpoint, ignored);
    const Double3 finest = swing(2.5e-4, RodIntegrator::midpoint, loss);
    (void)swing(2.5e-4, RodIntegrator::euler, euler_loss);
    CAPTURE(loss, euler_loss, apart(coarse, finest), apart(fine, finest));
    // the chord of a step is shorter than its arc: what that stretches falls with the fourth power of h
    CHECK(loss < 1e-4);
    CHECK(euler_loss > 20 * loss);
    CHECK(apart(coarse, finest) > 3.5 * apart(fine, finest));
}

TEST_CASE("energy never rises without work, whatever the step") {
    auto strands = assorted(6);
    for (const double h : {1e-3, 1e-2, 5e-2}) {
        RodSimulation rods = make(strands, {});
        std::vector<double> before;
        for (std::size_t s = 0; s < strands.size(); ++s)
            before.push_back(rods.energy(s).elastic() + rods.energy(s).potential);
        for (int k = 0; k < 20; ++k) {
            REQUIRE(rods.step(h));
            for (std::size_t s = 0; s < strands.size(); ++s) {
                const RodEnergy e = rods.energy(s);
                const double now = e.kinetic + e.elastic() + e.potential;
                CHECK(now <= before[s] + 1e-9 * std::abs(before[s]) + 1e-14);
                before[s] = now;
            }
        }
    }
}
