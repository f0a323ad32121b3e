// The grid of the friction and volume passes (METHODS 1.2): voxels in bricks of 4 x 4 x 4, so that
// only bricks with hair in them are cleared, summed and read.
//
//   voxel (x, y, z) stands at  x_part(x) + y_part(y) + z_part(z),
//   x_part = (x / 4) 64 + x % 4,  y_part = (y / 4) 64 nbx + (y % 4) 4,  z_part likewise times nby.
//
// Sums are 64-bit integers in fixed point: adding is exact, so neither order nor threads matter.
#pragma once

#include "runtime/pass/quad.h"

#include <cstddef>
#include <cstdint>

namespace keratin {

inline constexpr std::uint32_t kBrickSide = 4;
inline constexpr std::uint32_t kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;

// It turns and moves along with the asset, so that a groom that does too meets the voxels that it
// met at rest.
struct GridShape {
    float to_own[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // world to the grid's axes; rows of the matrix
    float place[3] = {};                            // m, world, where the grid's own 0 is
    std::uint32_t bricks[3] = {};                   // along each axis
    float origin[3] = {};                           // m, own, of voxel (0, 0, 0)'s sample point
    float spacing = 0;                              // m
    float inverse_spacing = 0;

    std::size_t brick_count() const { return std::size_t{bricks[0]} * bricks[1] * bricks[2]; }
};

// Fixed point of the sums: a mass of one mean point, a displacement of `displacement_unit`.
inline constexpr float kGridScale = 16777216.0f;  // 2^24

// What one thread adds to.
struct GridSums {
    // [voxels][4]: mass, mass * displacement / unit; null without friction
    std::int64_t* momentum = nullptr;
    std::int64_t* filling = nullptr;  // [voxels]: volume share, null without volume preservation
    std::uint8_t* touched = nullptr;  // [bricks]: a point's lowest voxel lies here
};

struct ScatterInput {
    GridShape shape;
    float inverse_displacement_unit = 0;  // 1/m
    float mass_scale = 0;                 // 1/m: one over the mean mass per line density of a point
    float filling_scale = 0;              // m^2: mass per line density over the voxel's volume
    float mean_density = 1;               // kg/m^3, where the asset stores none
    const std::uint32_t* point_count = nullptr;  // [64] of the quad's lanes
    const float* density = nullptr;              // tiled as lengths; null: mean_density
};

// Numbers of a voxel that the gather reads: with friction its mean displacement comes first.
constexpr std::size_t grid_field_floats(bool friction) { return friction ? 4 : 1; }

// What a guide point keeps of the groom at rest: the filling at its place but for its own share,
// and that share.
inline constexpr std::size_t kFillingRestFloats = 2;

// Mean displacement of each voxel (m per small step) and its filling, ready to be read.
struct GridView {
    GridShape shape;
    const float* field = nullptr;  // [voxels][grid_field_floats]: mean displacement, filling
    float step = 0;                // s, of the step to come
    float previous_step = 0;       // s, that the displacements belong to
    bool friction = false, volume = false;
    float limit = 0;  // m/s^2, of the volume's acceleration
};

}  // namespace keratin
