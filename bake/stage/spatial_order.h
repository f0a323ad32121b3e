// Orders in space: neighbours in the list are neighbours in space, or any prefix of the list is
// spread evenly over the whole.
#pragma once

#include "bake/raw_groom.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// Numbers of the points in the order in which a Morton curve through their common bounding cube, 21
// bits an axis, meets them; points of one cell by number.
std::vector<std::uint32_t> morton_order(std::span<const Vec3> points);

// The numbers 0..count-1 so that every prefix is spread evenly over 0..count-1 while long runs
// ascend: bit-reversed order, in which every doubling of the prefix adds 16 runs, each evenly
// spaced and sorted. A prefix is thus a fair sample to within a sixteenth of itself.
std::vector<std::uint32_t> prefix_uniform_order(std::uint32_t count);

}  // namespace keratin
