// Orders in space: neighbours in the list are neighbours in space, or any prefix of the list is
// spread evenly over the whole.
#pragma once

#include "bake/raw_groom.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// Place of each point on a Morton curve through the points' common bounding cube, 21 bits an axis.
std::vector<std::uint64_t> morton_keys(std::span<const Vec3> points);

// The numbers 0..count-1 so that every prefix is spread evenly over 0..count-1 while long runs
// ascend: the first 64th (every 64th number) is itself in this order, the other 63 parts follow,
// each every 64th number ascending, the parts in bit-reversed order. Runs short enough are in
// bit-reversed order as a whole.
std::vector<std::uint32_t> prefix_uniform_order(std::uint32_t count);

}  // namespace keratin
