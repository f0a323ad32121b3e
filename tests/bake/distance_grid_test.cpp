#include "bake/stage/distance_grid.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

using namespace keratin;

namespace {

// A sphere of radius 0.1 m about the origin from latitudes and longitudes, closed.
constexpr double kRadius = 0.1;

RawMesh sphere(std::uint32_t rings, std::uint32_t sides) {
    RawMesh mesh;
    const auto at = [&](std::uint32_t ring, std::uint32_t side) {
        return ring * sides + side % sides;
    };
    for (std::uint32_t r = 0; r <= rings; ++r)
        for (std::uint32_t s = 0; s < sides; ++s) {
            const double polar = std::numbers::pi * r / rings,
                         turn = 2 * std::numbers::pi * s / sides;
            mesh.position.emplace_back(kRadius * std::sin(polar) * std::cos(turn),
                                       kRadius * std::cos(polar),
                                       -kRadius * std::sin(polar) * std::sin(turn));
        }
    for (std::uint32_t r = 0; r < rings; ++r)
        for (std::uint32_t s = 0; s < sides; ++s) {
            if (r > 0) mesh.triangle.push_back({at(r, s), at(r + 1, s), at(r, s + 1)});
            if (r + 1 < rings)
                mesh.triangle.push_back({at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)});
        }
    mesh.parts.push_back({"sphere", 0, static_cast<std::uint32_t>(mesh.triangle.size())});
    return mesh;
}

Groom one_strand(const Vec3& root, const Vec3& tip) {
    Groom groom;
    groom.first_point = {0, 2};
    groom.position = {root, tip};
    return groom;
}

double distance_at(const BakedDistanceGrid& grid, const Vec3& x) {
    const Vec3 origin(grid.info.origin[0], grid.info.origin[1], grid.info.origin[2]);
    const Vec3 at = (x - origin) / (double{grid.info.spacing} * kBrickCells);
    const auto brick = at.array().floor().cast<int>();
    const std::uint32_t stored = grid.brick.at(
        static_cast<std::size_t>((brick[2] * static_cast<int>(grid.info.bricks[1]) + brick[1]) *
                                     static_cast<int>(grid.info.bricks[0]) +
                                 brick[0]));
    if (stored == kNoBrick) return INFINITY;
    return interpolate_brick(grid.distance.data() + std::size_t{stored} * kBrickNodes,
                             (at - at.array().floor().matrix()) * kBrickCells);
}

}  // namespace

TEST_CASE("a distance grid of a sphere gives its distance to within the stated error") {
    const RawMesh mesh = sphere(64, 128);
    const Groom groom = one_strand({0, kRadius, 0}, {0, 5 * kRadius, 0});
    Recipe recipe;
    recipe.distance_grid = true;
    recipe.distance_grid_spacing = 0.004;
    const auto grid = make_distance_grid(mesh, groom, {}, recipe);
    REQUIRE(grid);
    CHECK(grid->info.spacing == 0.004f);
    CHECK(grid->brick.size() ==
          std::size_t{grid->info.bricks[0]} * grid->info.bricks[1] * grid->info.bricks[2]);
    CHECK(grid->distance.size() == std::size_t{grid->info.stored_bricks} * kBrickNodes);
    CHECK(grid->info.stored_bricks < grid->brick.size());

    // The sphere's facets lie up to r (1 - cos(pi / 64)) inside it.
    const double facets = kRadius * (1 - std::cos(std::numbers::pi / 64));
    double worst = 0;
    for (int i = 0; i < 2000; ++i) {
        const double turn = 2.399963 * i, y = 1 - 2 * (i + 0.5) / 2000, r = std::sqrt(1 - y * y);
        const double radius = kRadius * (0.9 + 0.13 * std::fmod(0.618034 * i, 1.0));
        const double found =
            distance_at(*grid, radius * Vec3(r * std::cos(turn), y, r * std::sin(turn)));
        if (std::isfinite(found)) worst = std::max(worst, std::abs(found - (radius - kRadius)));
    }
    INFO("worst " << worst << " m, stated " << grid->info.max_error << " m");
    CHECK(worst < grid->info.max_error + facets + 1e-5);
    CHECK(grid->info.max_error < 1e-4);
    // Deep inside is stored, far outside is not.
    CHECK(distance_at(*grid, {0, 0, 0}) == Approx(-kRadius).margin(2e-3));
    CHECK(std::isinf(distance_at(*grid, Vec3(0.99, 0.99, 0.99) * kRadius)));
}

TEST_CASE("a distance grid covers only what hair can reach") {
    const RawMesh mesh = sphere(32, 64);
    Recipe recipe;
    recipe.distance_grid = true;
    recipe.distance_grid_spacing = 0.004;
    const auto near_top =
        make_distance_grid(mesh, one_strand({0, kRadius, 0}, {0, kRadius + 0.02, 0}), {}, recipe);
    REQUIRE(near_top);
    CHECK(near_top->info.origin[1] > 0.07f);
    const auto far_away = make_distance_grid(mesh, one_strand({0, 1, 0}, {0, 1.02, 0}), {}, recipe);
    REQUIRE(far_away);
    CHECK(far_away->brick.empty());
    CHECK(far_away->info.stored_bricks == 0);
}

TEST_CASE("a spacing that would fill the memory is refused with one that would do") {
    const RawMesh mesh = sphere(32, 64);
    Recipe recipe;
    recipe.file = "groom.json";
    recipe.distance_grid = true;
    recipe.distance_grid_spacing = 1e-6;
    const auto grid = make_distance_grid(mesh, one_strand({0, kRadius, 0}, {0, 1, 0}), {}, recipe);
    REQUIRE_FALSE(grid);
    const std::string message = to_string(grid.error());
    INFO(message);
    CHECK(message.find("groom.json: distance_grid.spacing") == 0);
    CHECK(message.find("write at least 0.0001") != std::string::npos);
}
