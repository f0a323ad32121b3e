#include "bake/stage/distance_grid.h"

#include <Eigen/Geometry>
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
    CHECK(grid->info.max_error < 1.5e-4);
    // Deep inside is stored, far outside is not.
    CHECK(distance_at(*grid, {0, 0, 0}) == Approx(-kRadius).margin(2e-3));
    CHECK(std::isinf(distance_at(*grid, Vec3(0.99, 0.99, 0.99) * kRadius)));
}

TEST_CASE("a sheet thinner than a cell does not stand out of its distance grid") {
    // 0.2 x 0.2 m and 1 mm thick, across the cells of 4 mm.
    RawMesh mesh;
    const Vec3 along = Vec3(1, 0.2, 0.1).normalized(),
               across = along.cross(Vec3(0, 0, 1)).normalized(), up = along.cross(across);
    for (int corner = 0; corner < 8; ++corner)
        mesh.position.push_back((corner & 1 ? 0.1 : -0.1) * along +
                                (corner & 2 ? 0.1 : -0.1) * across +
                                (corner & 4 ? 0.0005 : -0.0005) * up);
    mesh.triangle = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    mesh.parts.push_back({"sheet", 0, 12});
    Recipe recipe;
    recipe.distance_grid = true;
    recipe.distance_grid_spacing = 0.004;
    const auto grid = make_distance_grid(mesh, one_strand({0, 0, 0}, {0, 0.5, 0}), {}, recipe);
    REQUIRE(grid);
    double farthest_out = -1;
    for (int i = 0; i < 4000; ++i) {
        const double u = std::fmod(0.5 + 0.7548776662466927 * i, 1.0),
                     v = std::fmod(0.5 + 0.5698402909980532 * i, 1.0);
        const Vec3 on =
            (0.2 * u - 0.1) * along + (0.2 * v - 0.1) * across + (i & 1 ? 0.0005 : -0.0005) * up;
        farthest_out = std::max(farthest_out, distance_at(*grid, on));
    }
    // 1.3 mm where the nodes only sample the distance.
    INFO("the sheet stands " << farthest_out << " m out of its grid");
    CHECK(farthest_out < 1e-4);
}

TEST_CASE("a hole in the mesh is closed by a surface from which the distance grows") {
    // A sphere without its cap: inside and outside meet in the hole.
    RawMesh mesh = sphere(64, 128);
    std::erase_if(mesh.triangle, [&](const auto& c) {
        return mesh.position[c[0]].y() > 0.8 * kRadius && mesh.position[c[1]].y() > 0.8 * kRadius;
    });
    mesh.parts[0] = {"bowl", 0, static_cast<std::uint32_t>(mesh.triangle.size())};
    Recipe recipe;
    recipe.distance_grid = true;
    recipe.distance_grid_spacing = 0.004;
    const auto grid =
        make_distance_grid(mesh, one_strand({0, kRadius, 0}, {0, 3 * kRadius, 0}), {}, recipe);
    REQUIRE(grid);
    // The axis enters the solid through the hole; the rim is 6 cm away from it.
    double before = distance_at(*grid, {0.0003, 0.0865, 0.0003}), steepest = 0, deepest = 0;
    CHECK(before > 0.005);
    for (double y = 0.086; y > 0.06; y -= 0.0005) {
        const double d = distance_at(*grid, {0.0003, y, 0.0003});
        steepest = std::max(steepest, std::abs(d - before) / 0.0005);
        deepest = std::max(deepest, -d);
        before = d;
    }
    INFO("steepest " << steepest << ", deepest " << deepest << " m");
    CHECK(steepest < 1.2);  // 30 where the distance jumps from the rim's to minus the rim's
    CHECK(deepest > 0.01);
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
