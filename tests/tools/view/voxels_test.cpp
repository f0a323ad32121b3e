#include "tools/keratin-view/voxels.h"

#include <catch2/catch.hpp>

#include <numbers>

using namespace keratin::view;

namespace {

// A straight strand of n points along x from `from`.
void add_line(SubjectStrands& strands, std::array<float, 3> from, float step, int n, float radius) {
    for (int i = 0; i < n; ++i)
        strands.position.insert(strands.position.end(),
                                {from[0] + step * float(i), from[1], from[2]});
    strands.first_point.push_back(strands.first_point.back() + std::uint32_t(n));
    strands.radius.push_back(radius);
    strands.id.push_back(std::uint32_t(strands.id.size()));
}

std::vector<float> constant(std::size_t points, float x, float y, float z) {
    std::vector<float> velocity;
    for (std::size_t i = 0; i < points; ++i) velocity.insert(velocity.end(), {x, y, z});
    return velocity;
}

}  // namespace

TEST_CASE("hair along a line of voxel samples fills its section's share of them") {
    // On the samples' line in y and z, so that all of it falls into one row of voxels.
    constexpr float spacing = 0.01f, radius = 1e-3f;
    SubjectStrands strands;
    add_line(strands, {-0.1f, 0.02f, -0.03f}, spacing / 4, 81, radius);
    const VoxelValues values = voxel_values(strands, {}, spacing);
    const float share = std::numbers::pi_v<float> * radius * radius / (spacing * spacing);
    for (std::size_t p = 10; p < 70; ++p) CHECK(values.share[p] == Approx(share).epsilon(1e-3));
    CHECK(values.share[0] < share);  // nothing beyond the ends

    SubjectStrands twice = strands;
    add_line(twice, {-0.1f, 0.02f, -0.03f}, spacing / 4, 81, radius);
    CHECK(voxel_values(twice, {}, spacing).share[40] == Approx(2 * share).epsilon(1e-3));
    SubjectStrands apart = strands;
    add_line(apart, {-0.1f, 0.05f, -0.03f}, spacing / 4, 81, radius);
    CHECK(voxel_values(apart, {}, spacing).share[40] == Approx(share).epsilon(1e-3));
}

TEST_CASE("a common velocity stays, opposite ones cancel, thick hair counts for more") {
    constexpr float spacing = 0.01f;
    SubjectStrands strands;
    add_line(strands, {0.001f, 0.013f, 0.007f}, 0.003f, 20, 1e-4f);
    std::vector<float> velocity = constant(20, 1, -2, 3);
    VoxelValues values = voxel_values(strands, velocity, spacing);
    for (std::size_t p = 0; p < 20; ++p) {
        CHECK(values.velocity[3 * p] == Approx(1));
        CHECK(values.velocity[3 * p + 1] == Approx(-2));
        CHECK(values.velocity[3 * p + 2] == Approx(3));
    }
    add_line(strands, {0.001f, 0.013f, 0.007f}, 0.003f, 20, 1e-4f);
    const std::vector<float> back = constant(20, -1, 2, -3);
    velocity.insert(velocity.end(), back.begin(), back.end());
    values = voxel_values(strands, velocity, spacing);
    CHECK(values.velocity[30] == Approx(0).margin(1e-6));
    strands.radius[1] = 2e-4f;  // four times the volume: (1 - 4) / 5
    values = voxel_values(strands, velocity, spacing);
    CHECK(values.velocity[30] == Approx(-0.6f).epsilon(1e-4));
}

TEST_CASE("the grid has 48 voxels along the longest side of the hair") {
    SubjectStrands strands;
    add_line(strands, {0, 0, 0}, 0.1f, 4, 1e-4f);
    CHECK(voxel_spacing(strands) == Approx(0.3f / 48));
    CHECK(voxel_spacing({}) > 0);
}
