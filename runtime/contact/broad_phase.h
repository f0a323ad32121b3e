// Finds all pairs of overlapping boxes: in a dense grid where they are of similar size and spread
// out, in a tree of 16 children a node (implicit, over Morton order) where not. Of hair the grid is
// the faster by a third, from 10 000 to a million boxes (PERFORMANCE 4 has both against
// sort-and-sweep and hash grids).
#pragma once

#include "runtime/contact/search_kernels.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

enum class BroadPhaseMethod { automatic, grid, tree };

// Keeps its memory from call to call: no allocation once the scene stops growing.
class BroadPhase {
  public:
    // All pairs i < j whose boxes overlap or touch, each once, into pairs (which is emptied first).
    // Boxes are finite, low <= high.
    // Their order depends on the boxes only, not on threads (>= 1) nor on the instruction set.
    void find_pairs(std::span<const Box> boxes, int threads, std::vector<BoxPair>& pairs,
                    BroadPhaseMethod method = BroadPhaseMethod::automatic,
                    InstructionSet instruction_set = InstructionSet::automatic);

  private:
    bool build_grid(std::span<const Box> boxes, int threads);
    void build_tree(std::span<const Box> boxes, int threads);
    void sort_by_place(std::span<const Box> boxes, int threads);

    std::vector<std::uint32_t> order_, order_other_, key_, key_other_, histogram_;
    std::vector<std::uint32_t> cell_start_, cell_of_;
    std::vector<float> sorted_[6];
    GridView grid_{};
    std::vector<std::vector<BoxBlock>> levels_;
    TreeView tree_{};
    std::vector<std::vector<BoxPair>> found_;  // by each chunk of boxes
    std::vector<std::size_t> first_;           // where in `pairs` each chunk's begin
};

}  // namespace keratin
