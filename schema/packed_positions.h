// Rest positions of render strands in 16 bits a coordinate, as an asset may store them (recipe:
// quantise): half the bytes, and the largest error is known. Whoever opens an asset gets floats.
//
//   root    [strand * 3]  m, float: the strand's first point, exact
//   step    [strand]      m: a power of two, the least with which the strand's farthest coordinate
//                         from its root fits into 16 bits
//   packed  words of two signed 16-bit numbers, the lower half first: number 3 p + c is the
//           coordinate c of point p less that of its root, in steps
//
// Axes are those of the groom: one step serves all three, so turning them with the root would gain
// nothing. As steps are powers of two a point is root + step * number, rounded once; packing what
// was unpacked gives the same numbers again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

struct PackedPositions {
    std::vector<std::uint32_t> packed;  // [packed_words(points)]
    std::vector<float> root;            // [strands * 3] m
    std::vector<float> step;            // [strands] m
};

constexpr std::uint64_t packed_words(std::uint64_t points) { return (3 * points + 1) / 2; }

//   first_point [strands + 1]
//   position    [points * 3]  m, finite
PackedPositions pack_positions(std::span<const std::uint32_t> first_point,
                               std::span<const float> position);

// The sizes must fit each other: first_point ascends from 0 to the number of points.
//   position    [points * 3] out  m
void unpack_positions(std::span<const std::uint32_t> first_point,
                      std::span<const std::uint32_t> packed, std::span<const float> root,
                      std::span<const float> step, std::span<float> position);

}  // namespace keratin
