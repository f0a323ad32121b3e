// Where a number of a guide strand stands in a tiled array: the same in the file, in memory, in C++
// and in GLSL.
//
//   tile      kTileLanes strands side by side, one a lane
//   row       one point of every strand of a tile; row 0 holds the roots
//   quad      kQuadTiles tiles that are swept together; all tiles of a quad have the same number
//             of rows, and the number of tiles is a multiple of kQuadTiles
//
//   scalar of (tile t, point p, lane l)           (tile_first_row[t] + p) * 16 + l
//   component c of a vector of N at (t, p, l)     ((tile_first_row[t] + p) * N + c) * 16 + l
//   component c of N of a strand (lane t, l)      (t * N + c) * 16 + l
//   the strand's own number ("lane index")        t * 16 + l
//
// A strand with fewer points than its tile has rows repeats its last point below its tip, with rest
// length 0; an empty lane repeats the last strand of its tile and has point count 0.
#ifndef KERATIN_SCHEMA_LAYOUT_H
#define KERATIN_SCHEMA_LAYOUT_H

#ifdef __cplusplus
#include <cstddef>
#include <cstdint>

namespace keratin {

inline constexpr std::size_t kTileLanes = 16;
inline constexpr std::size_t kQuadTiles = 4;

// Point counts that the strand solver takes, root included.
inline constexpr std::uint32_t kStrandMinPoints = 3;
inline constexpr std::uint32_t kStrandMaxPoints = 32;
// Point counts that a bake makes.
inline constexpr std::uint32_t kBakeMinPoints = 2;
inline constexpr std::uint32_t kBakeMaxPoints = 1024;

inline constexpr std::uint32_t kNoStrand = 0xffffffffu;

// Distance grids are stored in bricks of kBrickCells^3 cells with (kBrickCells + 1)^3 nodes, so that
// no cell reaches into another brick; node (x, y, z) of a brick at ((z * 5) + y) * 5 + x.
inline constexpr std::uint32_t kBrickCells = 4;
inline constexpr std::uint32_t kBrickNodes = 125;
inline constexpr std::uint32_t kNoBrick = 0xffffffffu;

constexpr std::size_t scalar_index(std::size_t row, std::size_t lane) {
    return row * kTileLanes + lane;
}
constexpr std::size_t vector_index(std::size_t row, std::size_t components, std::size_t component,
                                   std::size_t lane) {
    return (row * components + component) * kTileLanes + lane;
}

}  // namespace keratin
#else
const uint kTileLanes = 16u;
const uint kQuadTiles = 4u;
const uint kNoStrand = 0xffffffffu;
uint scalar_index(uint row, uint lane) { return row * kTileLanes + lane; }
uint vector_index(uint row, uint components, uint component, uint lane) {
    return (row * components + component) * kTileLanes + lane;
}
#endif
#endif
