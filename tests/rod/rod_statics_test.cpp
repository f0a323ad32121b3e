// Shapes that bear their weight (runtime/rod/rod_statics.h): in equilibrium, at rest when
// simulated, and what is too soft is known.
#include "runtime/rod/rod_statics.h"

#include "runtime/rod/double3.h"
#include "runtime/rod/rod_simulation.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

using namespace keratin;

namespace {

const Double3 kGravity{0, -9.81, 0};

// Strands of all kinds: straight, bowed and curled, leaving in random directions, round and
// elliptic.
std::vector<RodStrand> strands(std::size_t count, double length, double radius,
                               std::size_t points) {
    std::mt19937_64 random(7);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    std::vector<RodStrand> out;
    for (std::size_t s = 0; s < count; ++s) {
        const Double3 t = unit({uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
        const Double3 u = any_normal(t), v = cross(t, u);
        const double curl = s % 3 == 0 ? 0 : uniform(0.02, 0.15) * length;
        const double turns = s % 3 == 1 ? 0.2 : uniform(0.5, 2);
        RodStrand strand;
        for (std::size_t p = 0; p < points; ++p) {
            const double f = static_cast<double>(p) / static_cast<double>(points - 1);
            const double a = 2 * std::numbers::pi * turns * f;
            Double3 x = scaled(f * length, t);
            x = add(x, add(scaled(curl * (std::cos(a) - 1), u), scaled(curl * std::sin(a), v)));
            for (double& c : x) c = static_cast<float>(c);
            strand.points.push_back(x);
        }
        strand.material.radii = {radius, s % 2 == 0 ? radius : 0.6 * radius};
        strand.root = RodEnd::clamped;
        strand.root_frame.normal = unit({uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
        out.push_back(strand);
    }
    return out;
}

RodStrand strand_of(std::vector<Double3> points) {
    RodStrand strand;
    strand.points = std::move(points);
    return strand;
}

// m, the farthest that any point of each strand has come from where it was.
std::vector<double> drift(const std::vector<RodStrand>& all, double seconds, double h) {
    RodSettings settings;
    settings.threads = 1;
    auto rods = RodSimulation::create(all, settings);
    if (!rods) FAIL(to_string(rods.error()));
    std::vector<double> out(all.size());
    for (double t = 0; t < seconds - h / 2; t += h) {
        REQUIRE(rods->step(h));
        for (std::size_t s = 0; s < all.size(); ++s)
            for (std::size_t p = 0; p < all[s].points.size(); ++p)
                out[s] = std::max(out[s], length(subtract(rods->position(s, p), all[s].points[p])));
    }
    return out;
}

}  // namespace

TEST_CASE("strands of any shape and section bear their weight where they are") {
    double worst_residual = 0;
    for (const double radius : {3e-5, 5e-5, 1e-4}) {
        auto plain = strands(24, 0.04, radius, 16);
        auto held = plain;
        std::size_t soft = 0;
        for (RodStrand& strand : held) {
            const WeightBorne borne = bear_weight(strand, kGravity);
            soft += !borne.held;
            if (borne.held) worst_residual = std::max(worst_residual, borne.residual);
            strand.rest_strain = borne.strain;
        }
        const auto sagged = drift(plain, 1, 2e-3), stays = drift(held, 1, 2e-3);
        const double most = *std::max_element(stays.begin(), stays.end()),
                     most_plain = *std::max_element(sagged.begin(), sagged.end());
        UNSCOPED_INFO("radius " << radius << " m: drift " << most << " m, without " << most_plain
                                << " m, residual " << worst_residual);
        for (const double d : sagged) CHECK(d > 1e-5);
        CHECK(most_plain > 4e-3);
        CHECK(soft == 0);
        CHECK(most < 1e-6);
    }
    CHECK(worst_residual < 1e-6);
}

TEST_CASE("a rod bears its weight upright below Greenhill's height and is too soft above it") {
    // A column clamped at its foot buckles under its own weight at (7.8373 E I / w)^(1/3).
    RodStrand strand;
    const RodMaterial& m = strand.material;
    const double r = m.radii[0];
    const double height = std::cbrt(7.8373 * m.youngs_modulus * r * r / (4 * m.density * 9.81));
    for (const double share : {0.8, 0.98, 1.02, 1.5}) {
        strand.points.clear();
        for (std::size_t p = 0; p < 32; ++p)
            strand.points.push_back({0, share * height * static_cast<double>(p) / 31, 0});
        const WeightBorne borne = bear_weight(strand, kGravity);
        INFO(share << ": residual " << borne.residual << ", settles " << borne.settles);
        CHECK(borne.held == (share < 1));
        CHECK((borne.settles == 0) == borne.held);
    }
}

TEST_CASE("strands that are too soft settle where it is said, nearer to their shape than without") {
    std::size_t soft = 0;
    for (const RodStrand& strand : strands(6, 0.25, 3e-5, 20)) {
        const WeightBorne borne = bear_weight(strand, kGravity);
        if (borne.held) continue;
        ++soft;
        double settles[2];
        for (const bool bears : {false, true}) {
            RodStrand one = strand;
            if (bears) one.rest_strain = borne.strain;
            auto rods = RodSimulation::create({&one, 1}, {});
            REQUIRE(rods);
            SettleOptions nudged;
            nudged.perturbation = 1e-6;
            rods->settle(nudged);
            settles[bears] = 0;
            for (std::size_t p = 0; p < one.points.size(); ++p)
                settles[bears] =
                    std::max(settles[bears], length(subtract(rods->position(0, p), one.points[p])));
        }
        INFO("without " << settles[0] << " m, bears " << settles[1] << ", said " << borne.settles);
        CHECK(settles[1] <= settles[0] * 1.001);
        CHECK(borne.settles == Approx(settles[1]).epsilon(1e-2));
    }
    CHECK(soft >= 3);
}

TEST_CASE("a single edge that is too soft settles about as near as any rest bend brings it") {
    for (const double edge : {0.08, 0.09, 0.12, 0.2}) {
        RodStrand strand = strand_of({{0, 0, 0}, {edge, 0, 0}});
        strand.root_frame.normal = Double3{0, 1, 0};
        const WeightBorne borne = bear_weight(strand, kGravity);
        double best = 1;
        for (double bend = -kMostBorneBend; bend <= kMostBorneBend; bend += 0.1) {
            RodStrand one = strand;
            one.rest_strain = {{0, {bend, 0}, 0}};
            auto rods = RodSimulation::create({&one, 1}, {});
            REQUIRE(rods);
            SettleOptions nudged;
            nudged.perturbation = 1e-6;
            if (!rods->settle(nudged).settled) continue;
            best = std::min(best, length(subtract(rods->position(0, 1), one.points[1])));
        }
        INFO(edge << " m: settles " << borne.settles << " m, with the best rest bend " << best);
        CHECK_FALSE(borne.held);
        CHECK(borne.settles < 1.05 * best);
    }
}

TEST_CASE("whatever a strand is like, the strain it gets is one that the solver takes") {
    std::vector<RodStrand> odd;
    odd.push_back(strand_of({{0, 0, 0}, {0.01, 0, 0}}));
    odd.push_back(strand_of({{0, 0, 0}, {0.01, 0, 0}, {0, 0, 0}, {0.01, 0, 0}}));
    odd.push_back(strand_of({{0, 0, 0}, {0.01, 0, 0}, {0.0101, 1e-9, 0}, {0.3, 0.1, 0}}));
    RodStrand jelly = strands(1, 0.3, 1e-3, 12)[0];
    jelly.material.youngs_modulus = 1;
    odd.push_back(jelly);
    jelly.material.poisson_ratio = -0.99;
    jelly.material.youngs_modulus = 1e15;
    odd.push_back(jelly);
    odd.push_back(strands(2, 0.1, 5e-5, 1024)[1]);
    for (RodStrand& strand : odd) {
        const WeightBorne borne = bear_weight(strand, kGravity);
        REQUIRE(borne.strain.size() + 1 == strand.points.size());
        for (const RodStrain& s : borne.strain) {
            CHECK(std::fabs(s.stretch) <= 0.5);
            CHECK(std::max(std::fabs(s.bend[0]), std::fabs(s.bend[1])) <= 8);
            CHECK(std::fabs(s.twist) <= 30);
        }
        CHECK(std::isfinite(borne.residual));
        CHECK(std::isfinite(borne.settles));
        strand.rest_strain = borne.strain;
        auto rods = RodSimulation::create({&strand, 1}, {});
        REQUIRE(rods);
        for (int k = 0; k < 3; ++k) REQUIRE(rods->step(1e-3));
        CHECK(rods->finite());
    }
}

TEST_CASE("a rest strain that no rod can have is refused, and named") {
    RodStrand strand = strand_of({{0, 0, 0}, {0.01, 0, 0}, {0.02, 0, 0}});
    const auto refusal = [&] {
        auto rods = RodSimulation::create({&strand, 1}, {});
        return rods ? "" : to_string(rods.error());
    };
    strand.rest_strain.resize(1);
    CHECK(refusal().find("strands[0].rest_strain: needs one entry an edge") != std::string::npos);
    strand.rest_strain.resize(2);
    CHECK(refusal() == "");
    strand.rest_strain[1].stretch = -1;
    CHECK(refusal().find("strands[0].rest_strain[1]: must be finite, with a stretch above -1") !=
          std::string::npos);
    strand.rest_strain[1] = {0, {0, NAN}, 0};
    CHECK(refusal().find("rest_strain[1]") != std::string::npos);
    strand.rest_strain[1] = {};
    strand.natural_curvature = {0, 0};
    CHECK(refusal().find("cannot go with natural_curvature") != std::string::npos);
}
