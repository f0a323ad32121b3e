// Sizes of the buffers of a simulation, from the asset and the settings: the one place that says
// how many of what a buffer holds. Used by the plan (to print) and by the simulation (to allocate).
#pragma once

#include "runtime/pass/grid.h"
#include "runtime/settings.h"
#include "schema/asset.h"

#include <cstdint>

namespace keratin {

// What the sizes depend on.
struct RunShape {
    std::uint32_t rows = 0, tiles = 0, quads = 0, longest = 0;  // longest: rows of the longest quad
    std::uint32_t bones = 0, vertices = 0, colliders = 0, threads = 1;
    std::uint32_t strands = 0, points = 0;  // of the largest level of detail
    bool one_motion = true;                 // a single transform carries every root
    bool by_triangle = false;
    bool friction = false, volume = false, half = false, tangents = false, previous = false,
         simulated = true;
    std::uint32_t grid_bricks_along = 0;
    std::uint32_t classes = 0;
};

// Small steps whose collider poses are laid out at a time.
inline constexpr std::uint32_t kStepsAtOnce = 16;

// Numbers between the threads' lists of near colliders: written and read all the time, so no two in
// lines of the cache that are fetched together.
inline std::size_t near_stride(std::uint32_t colliders) {
    return (std::size_t{colliders} + 31) / 32 * 32;
}

RunShape run_shape(const AssetInfo& info, const AssetFields& fields, const Settings& settings);

// Threads that a setting of 0 or more comes to.
int thread_count(int wanted);

// Colliders that the asset brings: its distance grid alone, or the fitted shapes.
std::size_t asset_collider_count(const AssetInfo& info);
std::uint32_t asset_collider_bone(const AssetInfo& info, std::size_t index);

}  // namespace keratin
