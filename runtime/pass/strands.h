// What the interpolation of render strands reads and writes.
#pragma once

#include "runtime/pass/quad.h"

#include <cstddef>
#include <cstdint>

namespace keratin {

constexpr std::size_t kLineBehind = 16;

struct StrandBatch {
    const std::uint32_t* first_point = nullptr;  // [strands + 1]
    std::size_t points = 0;                      // of all strands
    const float* rest = nullptr;                 // [points * 3]
    const float* fraction = nullptr;             // [points], null: evenly spaced
    const std::uint32_t* guide = nullptr;        // [strands * 3] lane indices
    const float* weight = nullptr;               // [strands * 3]
    const float* root =
        nullptr;  // [strands * 7] quaternion, translation; one for all with stride 0
    std::size_t root_stride = 0;  // floats
    // Displacement of the guides: point p of lane (t, l) at line_first(...) + p * 3, with
    // kLineBehind floats behind the last that are read and not used.
    const float* line = nullptr;
    const std::uint32_t* tile_first_row = nullptr;
    const std::uint32_t* guide_point_count = nullptr;  // [lanes]
    const std::uint32_t* guide_strand = nullptr;       // [lanes], for their fractions

    float* position = nullptr;      // [points * 3] or null
    std::uint16_t* half = nullptr;  // [points * 3] or null
    float half_center[3] = {};
    float* tangent = nullptr;  // [points * 3] or null
    bool stream = false;       // write past the cache
};

// First float of a lane's line: strands of a tile one after another.
[[gnu::always_inline]] inline std::size_t line_first(const std::uint32_t* tile_first_row,
                                                     std::uint32_t lane) {
    const std::size_t tile = lane / kTileLanes, l = lane % kTileLanes;
    const std::size_t first = tile_first_row[tile];
    const std::size_t rows = tile_first_row[tile + 1] - first;
    return (first * kTileLanes + l * rows) * 3;
}

}  // namespace keratin
