// The inner loops of the search for contacts, compiled once for each instruction set.
#pragma once

#include "runtime/lane/instruction_set.h"
#include "schema/formula/vec3.h"

#include <cstdint>
#include <vector>

namespace keratin {

// Axis-aligned.
struct Box {
    float bound[6];  // low x, y, z, high x, y, z
};

struct BoxPair {
    std::uint32_t first, second;  // first < second
    friend bool operator==(const BoxPair&, const BoxPair&) = default;
};

// Where a kernel puts the pairs that it finds: it knows nothing of vectors, whose code would be
// compiled for its instruction set and linked into everybody's path.
struct PairSink {
    BoxPair *at, *end;
    void (*grow)(PairSink&);  // makes room for one more at least
    std::vector<BoxPair>* pairs;
};

// 16 boxes; empty ones (low > high) behind the last.
struct alignas(64) BoxBlock {
    float bound[6][16];
};

// Boxes in the order of the cells that their low corners are in; 16 empty ones behind the last.
struct GridView {
    const float* bound[6];
    const std::uint32_t *start, *index;  // first box of each cell; number of each box
    float low[3], inverse[3];            // m, 1/m: where cells begin, how many to the metre
    float largest[3];                    // m, of the boxes
    int cells[3];

    KERATIN_ALWAYS_INLINE int cell(float x, int axis) const {
        const float c = (x - low[axis]) * inverse[axis];
        return c <= 0                                 ? 0
               : c >= static_cast<float>(cells[axis]) ? cells[axis] - 1
                                                      : static_cast<int>(c);
    }
};

inline constexpr int kMostLevels = 8;  // 16^8 = 2^32 boxes
// Level 0 holds the boxes; a box of each level above bounds a block of the level below.
struct TreeView {
    const BoxBlock* level[kMostLevels];
    std::uint32_t level_count;   // the top one has one block
    const std::uint32_t* index;  // number of each box of level 0
};

// Two edges each in 16 lanes: ends a and b at the start, their displacements over the step (m).
struct EdgePairs {
    alignas(64) float first[12][16], second[12][16];
};

struct SearchKernels {
    // Pairs of overlapping boxes of which the first in search order is one of begin .. end
    // (multiples of 16, or the number of boxes).
    void (*search_grid)(const GridView& grid, std::uint32_t begin, std::uint32_t end,
                        PairSink& out);
    void (*search_tree)(const TreeView& tree, std::uint32_t begin, std::uint32_t end,
                        PairSink& out);
    // Bit i: the edges of lane i may come within limit[i] (m, rounding included) in the step, as
    // far as so many rounds of advancement tell (>= 1).
    std::uint32_t (*may_meet)(const EdgePairs& pairs, const float* limit, int rounds);
};

const SearchKernels& search_kernels(InstructionSet wanted);

}  // namespace keratin
