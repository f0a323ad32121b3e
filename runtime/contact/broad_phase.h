// Finds all pairs of overlapping boxes. A dense grid up to 100 000 boxes of similar size, a tree of
// 16 children a node (implicit, over Morton order) above and for boxes of very different size
// (PERFORMANCE 4: measured against sort-and-sweep and hash grids).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// Axis-aligned boxes, one array a bound, [count] each; finite, low <= high.
struct BoxBounds {
    std::span<const float> low_x, low_y, low_z, high_x, high_y, high_z;
    std::size_t size() const { return low_x.size(); }
};

struct BoxPair {
    std::uint32_t first, second;  // first < second
    friend bool operator==(const BoxPair&, const BoxPair&) = default;
};

enum class BroadPhaseMethod { automatic, grid, tree };

// Keeps its memory from call to call: no allocation once the scene stops growing.
class BroadPhase {
  public:
    // All pairs i < j whose boxes overlap or touch, each once, into pairs (which is emptied first).
    // Their order depends on the boxes only, not on threads (>= 1).
    void find_pairs(const BoxBounds& boxes, int threads, std::vector<BoxPair>& pairs,
                    BroadPhaseMethod method = BroadPhaseMethod::automatic);

  private:
    struct Sorted {  // boxes in search order, padded by 16 empty ones
        std::vector<float> low_x, low_y, low_z, high_x, high_y, high_z;
        std::vector<std::uint32_t> index;
        void fill(const BoxBounds& boxes, std::span<const std::uint32_t> order, int threads);
    };

    bool build_grid(const BoxBounds& boxes, int threads);
    void build_tree(const BoxBounds& boxes, int threads);
    void query(std::size_t count, bool grid, int threads, std::vector<BoxPair>& pairs);

    Sorted sorted_;
    std::vector<std::uint32_t> order_, order_other_, key_, key_other_;
    std::vector<std::uint32_t> cell_start_;
    std::vector<std::uint32_t> cell_of_;
    float cell_low_[3] = {}, cell_inverse_[3] = {}, largest_[3] = {};
    int cells_[3] = {};
    std::vector<Sorted> levels_;  // of the tree: boxes over 16 boxes of the level below
    std::vector<std::vector<BoxPair>> found_;
    std::vector<std::uint32_t> histogram_;

    friend struct BroadPhaseKernel;
};

}  // namespace keratin
