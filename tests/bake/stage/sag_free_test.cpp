#include "bake/stage/sag_free.h"

#include "bake/stage/strand_statics.h"
#include "runtime/simulation.h"
#include "tools/scenes/groom.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <omp.h>

using namespace keratin;
using scenes::Line;

namespace {

using V = Vec3<double>;
const V kGravity(0, -9.81, 0);

// A hair of the default material: E I over the weight of a metre is (4 cm)^3.
Material hair(double youngs_modulus = 2e9) {
    Material m;
    m.youngs_modulus = float(youngs_modulus);
    return m;
}
double bending_of(const Material& m) {
    return double(m.youngs_modulus) * m.radius * m.radius / (4 * double(m.density));
}

// The lines as an asset whose strands are all guides, in the order given.
struct Baked {
    AssetInfo info;
    AssetArrays arrays;
    Findings findings;
    BakeReport::SagFree report;

    Baked(const std::vector<Line>& lines, const Material& material, bool sag_free = true) {
        scenes::GroomOptions options;
        options.group.material = material;
        const scenes::Groom groom = scenes::make_groom(lines, options);
        info = groom.info;
#define X(name, element, domain, components, presence, target, unit, meaning) \
    arrays.name = groom.name;
        KERATIN_ASSET_FIELDS(X)
#undef X
        const std::uint8_t chosen[] = {sag_free};
        report = make_sag_free(info.groups, chosen, arrays, findings);
    }

    double distance_from_groom(std::span<const float> position, std::size_t strand) const {
        const std::size_t lane = strand % kTileLanes;
        double worst = 0;
        for (std::size_t p = 0; p < arrays.guide_point_count[strand]; ++p) {
            double square = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t at =
                    vector_index(arrays.tile_first_row[strand / kTileLanes] + p, 3, c, lane);
                const double d = double(position[at]) - double(arrays.guide_position[at]);
                square += d * d;
            }
            worst = std::max(worst, std::sqrt(square));
        }
        return worst;
    }

    // m, largest distance of each strand's points from the groom after a while at rest.
    std::vector<double> settle(double seconds = 3, double step = 1.0 / 60) const {
        Settings settings;
        settings.threads = 1;
        auto simulation = Simulation::create(info, arrays.fields(), settings);
        if (!simulation) FAIL(to_string(simulation.error()));
        for (double t = 0; t < seconds; t += step) REQUIRE(simulation->step(step));
        std::vector<double> out;
        for (std::size_t s = 0; s < info.guide_count; ++s)
            out.push_back(distance_from_groom(simulation->guides().position, s));
        return out;
    }
};

double worst(const std::vector<double>& values) {
    return *std::max_element(values.begin(), values.end());
}

Line curl(std::uint32_t points) {
    Line out;
    for (std::uint32_t p = 0; p < points; ++p) {
        const double f = double(p) / (points - 1), turn = 4 * std::numbers::pi * f;
        out.push_back({0.06 * f, 0.006 * std::cos(turn), 0.006 * std::sin(turn)});
    }
    return out;
}

std::vector<V> points_of(const Line& line) {
    std::vector<V> out;
    for (const auto& p : line) out.push_back(V(p[0], p[1], p[2]));
    return out;
}

}  // namespace

TEST_CASE("a level strand stays level") {
    const std::vector<Line> lines{scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.04, 16),
                                  scenes::straight_line({0, 0, 0}, {0, 0, 1}, 0.03, 3),
                                  scenes::straight_line({0, 0, 0}, {0.6, 0, 0.8}, 0.05, 32)};
    const Baked plain(lines, hair(), false), baked(lines, hair());
    CHECK(baked.findings.empty());
    CHECK(baked.report.guides == 3);
    CHECK(baked.report.too_soft == 0);
    CHECK(baked.report.residual.max < 1e-9);
    CHECK(worst(plain.settle()) > 0.002);
    const double left = worst(baked.settle());
    INFO(1e3 * left << " mm");
    CHECK(left < 1e-5);
}

TEST_CASE("a curl stays as it was groomed") {
    const std::vector<Line> lines{curl(16), curl(32)};
    const Baked plain(lines, hair(), false), baked(lines, hair());
    CHECK(baked.findings.empty());
    CHECK(worst(plain.settle()) > 0.002);
    const double left = worst(baked.settle());
    INFO(1e3 * left << " mm");
    CHECK(left < 3e-5);
}

TEST_CASE("hair that leaves a head in all directions stays as it was groomed, at any step") {
    const std::vector<Line> lines = scenes::hair_on_sphere(48, 16, 0.08, 0.06, 0.003);
    const Baked baked(lines, hair());
    CHECK(baked.findings.empty());
    CHECK(worst(Baked(lines, hair(), false).settle()) > 0.005);
    for (const double step : {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 240}) {
        const double left = worst(baked.settle(2, step));
        INFO(1e3 * left << " mm at " << step << " s");
        CHECK(left < 5e-5);
    }
}

TEST_CASE("hair of any stiffness that can be held is held") {
    for (const double young : {2e9, 1e10, 1e11}) {
        const Baked baked({scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.03, 16), curl(24)},
                          hair(young));
        const double left = worst(baked.settle());
        INFO(young << " Pa: " << 1e3 * left << " mm");
        CHECK(baked.findings.empty());
        CHECK(left < 5e-5);
    }
}

TEST_CASE("strands that are too soft are named, and sag as little as they can") {
    const std::vector<Line> lines{scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.04, 16),
                                  scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.1, 16),
                                  scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.04, 16),
                                  scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.12, 16)};
    const Baked plain(lines, hair(), false), baked(lines, hair());
    REQUIRE(baked.findings.size() == 1);
    CHECK(baked.findings[0].rule == Rule::sags);
    CHECK(baked.findings[0].strands == std::vector<StrandRange>{{1, 1}, {3, 3}});
    CHECK(baked.report.too_soft == 2);
    CHECK(baked.report.residual.max > 0.01);
    REQUIRE(baked.report.each.size() == 4);
    for (const auto& guide : baked.report.each) {
        CHECK(guide.held == (guide.strand % 2 == 0));
        CHECK((guide.residual < 1e-6) == guide.held);
        CHECK((guide.settles == 0) == guide.held);
    }
    const auto before = plain.settle(), after = baked.settle();
    for (const std::size_t s : {1, 3}) {
        INFO("strand " << s << ": " << 1e3 * before[s] << " mm, sag-free " << 1e3 * after[s]);
        CHECK(after[s] < 0.6 * before[s]);
    }
    for (const std::size_t s : {0, 2}) CHECK(after[s] < 1e-5);
    INFO("said " << 1e3 * baked.report.settles.max << " mm, is " << 1e3 * worst(after));
    CHECK(baked.report.settles.max == Approx(worst(after)).epsilon(0.05));
}

TEST_CASE("an upright strand is held below Greenhill's height and named above it") {
    // A column clamped at its foot buckles under its own weight at (7.8373 E I / w)^(1/3).
    const Material m = hair();
    const double height = std::cbrt(7.8373 * bending_of(m) / 9.81);
    for (const double share : {0.8, 0.97, 1.03, 1.5}) {
        INFO(share);
        const Baked baked({scenes::straight_line({0, 0, 0}, {0, 1, 0}, share * height, 32)}, m);
        CHECK(baked.report.too_soft == (share > 1));
    }
}

TEST_CASE("what a strand feels at rest is the slope of its energy") {
    StrandStatics s = strand_statics(points_of(curl(12)), bending_of(hair()), kGravity);
    const std::vector<V> groomed = s.unloaded;
    carry_weight(s, groomed, 0.5);
    std::vector<V> t = groomed;
    for (std::size_t m = 2; m < t.size(); ++m)
        t[m] = normalize_or(t[m] + V(0.3, -0.2, 0.1 * double(m % 3)), t[m]);
    const auto slope = gradient(s, t);
    const double step = 1e-6;
    for (std::size_t m = 2; m < t.size(); ++m)
        for (const V& way : {V(1, 0, 0), V(0, 1, 0), V(0, 0, 1)}) {
            const V side = way - t[m] * dot(way, t[m]);
            const auto at = [&](double x) {
                std::vector<V> moved = t;
                moved[m] = normalize_or(t[m] + side * x, t[m]);
                return energy(s, moved);
            };
            const double expected = (at(step) - at(-step)) / (2 * step);
            REQUIRE(dot(slope[m], side) == Approx(expected).margin(1e-8));
        }
}

TEST_CASE("a strand settles where nothing is left to balance") {
    for (const double length : {0.03, 0.1, 0.3}) {
        const Line line = scenes::straight_line({0, 0, 0}, {0.8, 0.6, 0}, length, 16);
        const StrandStatics s = strand_statics(points_of(line), bending_of(hair()), kGravity);
        const auto t = settled(s, s.unloaded);
        INFO(length);
        CHECK(residual(s, s.unloaded) > 0.1);
        CHECK(residual(s, t) < 1e-6);
        CHECK(energy(s, t) < energy(s, s.unloaded));
        CHECK(stable(s, t, 0));
    }
}

TEST_CASE("sag-free rest shapes are the same with any number of threads") {
    const std::vector<Line> lines = scenes::hair_on_sphere(200, 12, 0.08, 0.12, 0.003);
    const int before = omp_get_max_threads();
    std::vector<std::vector<float>> shapes;
    for (const int threads : {1, 2, 7}) {
        omp_set_num_threads(threads);
        shapes.push_back(Baked(lines, hair()).arrays.guide_shape);
    }
    omp_set_num_threads(before);
    CHECK(shapes[0] == shapes[1]);
    CHECK(shapes[0] == shapes[2]);
    CHECK(shapes[0] != Baked(lines, hair(), false).arrays.guide_shape);
}

TEST_CASE("sag-free rest shapes keep lengths, and empty lanes repeat the guide before them") {
    const Baked baked(scenes::hair_on_sphere(5, 9, 0.08, 0.06, 0.003), hair());
    for (std::size_t p = 1; p < 9; ++p)
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            const auto c = [&](std::size_t k) {
                return double(baked.arrays.guide_shape[vector_index(p, 3, k, lane)]);
            };
            CHECK(std::hypot(c(0), c(1), c(2)) ==
                  Approx(double(baked.arrays.guide_length[scalar_index(p, lane)])).epsilon(1e-6));
            if (lane >= 5)
                for (std::size_t k = 0; k < 3; ++k)
                    CHECK(baked.arrays.guide_shape[vector_index(p, 3, k, lane)] ==
                          baked.arrays.guide_shape[vector_index(p, 3, k, 4)]);
        }
}

TEST_CASE("a group is made sag-free as its own part of the recipe says, or as the recipe does") {
    Recipe recipe;
    recipe.sag_free = true;
    GroupRecipe loose{"loose", {}, {}, false};
    recipe.groups.push_back(loose);
    const std::vector<GroupInfo> groups{{"top", {}, {}}, {"loose", {}, {}}, {"tail", {}, {}}};
    CHECK(sag_free_groups(groups, recipe) == std::vector<std::uint8_t>{1, 0, 1});
    recipe.sag_free = false;
    recipe.groups[0].sag_free = true;
    CHECK(sag_free_groups(groups, recipe) == std::vector<std::uint8_t>{0, 1, 0});
}
