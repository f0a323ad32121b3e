// The cells of the grid that a row of a tile lies in, found for all of its lanes at once.
#pragma once

#include "runtime/pass/grid.h"
#include "runtime/pass/trilinear.h"

namespace keratin::KERATIN_ISA {

using Tile = Lanes<kTileLanes>;

struct Cells : GridCells<Tile> {
    // Of the lowest voxel: its brick, its place, and how far the next one lies along each axis.
    alignas(64) std::uint32_t brick[kTileLanes], voxel[kTileLanes], next[3][kTileLanes];

    KERATIN_ALWAYS_INLINE Cells(const GridShape& g, const Vec3<Tile>& x)
        : GridCells(g.origin, g.inverse_spacing,
                    {g.bricks[0] * kBrickSide - 1, g.bricks[1] * kBrickSide - 1,
                     g.bricks[2] * kBrickSide - 1},
                    times(g.to_own, x - splat<Tile>(g.place))) {
        const std::uint32_t row = g.bricks[0], slab = row * g.bricks[1];
        constexpr std::uint32_t kStep[3] = {1, kBrickSide, kBrickSide * kBrickSide};
        const std::uint32_t to_brick[3] = {kBrickVoxels, kBrickVoxels * row, kBrickVoxels * slab};
        for (std::size_t l = 0; l < kTileLanes; ++l) {
            std::uint32_t in_brick = 0;
            brick[l] = 0;
            for (std::uint32_t c = 0; c < 3; ++c) {
                const std::uint32_t v = cell[c][l], in = v % kBrickSide;
                brick[l] += v / kBrickSide * (to_brick[c] / kBrickVoxels);
                in_brick += in * kStep[c];
                next[c][l] = in == kBrickSide - 1 ? to_brick[c] - in * kStep[c] : kStep[c];
            }
            voxel[l] = brick[l] * kBrickVoxels + in_brick;
        }
    }

    // Place of corner k = x + 2 y + 4 z of lane l's cell.
    KERATIN_ALWAYS_INLINE void corners(std::size_t l, std::uint32_t (&at)[8]) const {
        const std::uint32_t x = next[0][l], y = next[1][l], z = next[2][l];
        at[0] = voxel[l], at[1] = at[0] + x, at[2] = at[0] + y, at[3] = at[1] + y;
        for (int k = 0; k < 4; ++k) at[k + 4] = at[k] + z;
    }
    // What corner k counts.
    KERATIN_ALWAYS_INLINE Tile weight(unsigned k) const {
        const auto part = [&](unsigned c) { return k >> c & 1 ? share[c] : Tile(1.0f) - share[c]; };
        return part(0) * part(1) * part(2);
    }
};

// Half of the segments on either side of each point in a row of a quad: what it stands for.
KERATIN_ALWAYS_INLINE Tile carried_length(const float* length, std::size_t row, bool has_child) {
    const Tile below = has_child ? load<Tile>(length + (row + 1) * kTileLanes, 0) : Tile(0.0f);
    return (load<Tile>(length + row * kTileLanes, 0) + below) * Tile(0.5f);
}

// What the points of a row fill of a voxel (filled_share).
KERATIN_ALWAYS_INLINE Tile filled(const ScatterInput& in, const float* length, std::size_t row,
                                  bool has_child) {
    const Tile rho =
        in.density ? load<Tile>(in.density + row * kTileLanes, 0) : Tile(in.mean_density);
    return filled_share(carried_length(length, row, has_child) * Tile(in.filling_scale), rho);
}

}  // namespace keratin::KERATIN_ISA
