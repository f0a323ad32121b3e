// Throws out pairs of edges that are too far apart to meet within a step: conservative advancement
// in float, many pairs at a time.
#pragma once

#include "runtime/contact/search_kernels.h"

#include <span>
#include <vector>

namespace keratin {

// One edge, one cache line. Positions relative to a common origin.
struct alignas(64) FilterEdge {
    float value[12];      // m: ends a and b at the start, their displacements over the step
    float half_distance;  // m; two edges touch at the sum of theirs
    float error;          // m, bound of the rounding of this edge's numbers
    std::uint32_t strand;
    std::uint32_t unused;
};
static_assert(sizeof(FilterEdge) == 64);

// Appends the pairs that may meet to kept, in the order given. Never drops a pair that does.
void keep_near_pairs(std::span<const FilterEdge> edges, std::span<const BoxPair> pairs,
                     std::vector<BoxPair>& kept,
                     InstructionSet instruction_set = InstructionSet::automatic);

}  // namespace keratin
