#include "runtime/contact/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace keratin {
namespace {

constexpr std::uint32_t kChunk = 1024;      // boxes a thread takes at a time
constexpr float kEmpty = std::numeric_limits<float>::infinity();

void grow(PairSink& sink) {
    std::vector<BoxPair>& pairs = *sink.pairs;
    const std::size_t used = pairs.size();
    pairs.resize(std::max<std::size_t>(256, 2 * used));
    sink.at = pairs.data() + used;
    sink.end = pairs.data() + pairs.size();
}

// Spreads the low 10 bits so that two zero bits follow each.
std::uint32_t spread(std::uint32_t x) {
    x = (x | (x << 16)) & 0x030000FFu;
    x = (x | (x << 8)) & 0x0300F00Fu;
    x = (x | (x << 4)) & 0x030C30C3u;
    x = (x | (x << 2)) & 0x09249249u;
    return x;
}

Box around(const BoxBlock& block) {
    Box box;
    for (int k = 0; k < 6; ++k) {
        const float* b = block.bound[k];
        box.bound[k] = k < 3 ? *std::min_element(b, b + 16) : *std::max_element(b, b + 16);
    }
    return box;
}

}  // namespace

// False when the boxes differ so much in size, or crowd so few of the cells, that a grid would
// search most of itself.
bool BroadPhase::build_grid(std::span<const Box> boxes, int threads) {
    const std::size_t n = boxes.size();
    constexpr float kLargestOverMean = 8;  // beyond it the searched rows are mostly empty
    constexpr double kCellsOverBoxes = 4;  // bounds the memory of a thinly filled grid
    constexpr double kCrowd = 64;          // boxes that share the mean box's cell
    double cells_total = 1;
    float size[3], range[3];
    GridView& g = grid_;
    for (int a = 0; a < 3; ++a) {
        float least = boxes[0].bound[a], most = least, largest = 0;
        double sum = 0;
        for (const Box& box : boxes) {
            least = std::min(least, box.bound[a]);
            most = std::max(most, box.bound[a]);
            const float extent = box.bound[3 + a] - box.bound[a];
            largest = std::max(largest, extent);
            sum += extent;
        }
        const float mean = static_cast<float>(sum / static_cast<double>(n));
        if (largest > kLargestOverMean * mean) return false;
        g.low[a] = least;
        // The search subtracts it from a bound: both roundings must stay on the safe side.
        g.largest[a] = largest * 1.0001f + 4e-7f * std::max(std::fabs(least), std::fabs(most));
        range[a] = most - least;
        size[a] = std::max({largest, mean, range[a] * 1e-3f, std::numeric_limits<float>::min()});
        cells_total *= range[a] / size[a] + 1;
    }
    const double limit = kCellsOverBoxes * static_cast<double>(n) + 64;
    const float grow =
        cells_total > limit ? static_cast<float>(std::cbrt(cells_total / limit)) : 1.0f;
    for (int a = 0; a < 3; ++a) {
        g.cells[a] = static_cast<int>(range[a] / (size[a] * grow)) + 1;
        g.inverse[a] = 1 / (size[a] * grow);
    }
    const std::size_t cells = static_cast<std::size_t>(g.cells[0]) * g.cells[1] * g.cells[2];
    if (static_cast<double>(cells) > 8 * limit) return false;

    cell_of_.resize(n);
    cell_start_.assign(cells + 1, 0);
    for (std::size_t i = 0; i < n; ++i) {
        const float* low = boxes[i].bound;
        const int x = g.cell(low[0], 0), y = g.cell(low[1], 1), z = g.cell(low[2], 2);
        cell_of_[i] = static_cast<std::uint32_t>(
            (static_cast<std::size_t>(z) * g.cells[1] + y) * g.cells[0] + x);
        ++cell_start_[cell_of_[i] + 1];
    }
    double together = 0;
    for (std::size_t c = 0; c < cells; ++c) {
        const double count = cell_start_[c + 1];
        together += count * count;
        cell_start_[c + 1] += cell_start_[c];
    }
    if (together > kCrowd * static_cast<double>(n)) return false;
    order_.resize(n);
    for (std::size_t i = n; i-- > 0;)
        order_[--cell_start_[cell_of_[i] + 1]] = static_cast<std::uint32_t>(i);
    // Each start moved down to its cell's first box, one place too high: shift back.
    for (std::size_t c = 0; c < cells; ++c) cell_start_[c] = cell_start_[c + 1];
    cell_start_[cells] = static_cast<std::uint32_t>(n);

    for (int k = 0; k < 6; ++k) {
        sorted_[k].resize(n + 16);
        g.bound[k] = sorted_[k].data();
        std::fill(sorted_[k].begin() + static_cast<std::ptrdiff_t>(n), sorted_[k].end(),
                  k < 3 ? kEmpty : -kEmpty);
    }
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t i = 0; i < n; ++i)
        for (int k = 0; k < 6; ++k) sorted_[k][i] = boxes[order_[i]].bound[k];
    g.start = cell_start_.data();
    g.index = order_.data();
    return true;
}

// Makes order_: along the Morton curve through the boxes' centres.
void BroadPhase::sort_by_place(std::span<const Box> boxes, int threads) {
    const std::size_t n = boxes.size();
    // Twice the centre.
    const auto middle = [](const Box& box, int axis) {
        return box.bound[axis] + box.bound[3 + axis];
    };
    float least[3], scale[3];
    for (int a = 0; a < 3; ++a) {
        float most = middle(boxes[0], a);
        least[a] = most;
        for (const Box& box : boxes) {
            least[a] = std::min(least[a], middle(box, a));
            most = std::max(most, middle(box, a));
        }
        const float range = most - least[a];
        scale[a] = range > 1e-30f ? 1023.0f / range : 0;
    }
    key_.resize(n), key_other_.resize(n), order_.resize(n), order_other_.resize(n);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t i = 0; i < n; ++i) {
        std::uint32_t code = 0;
        for (int a = 0; a < 3; ++a)
            code |= spread(static_cast<std::uint32_t>((middle(boxes[i], a) - least[a]) * scale[a]))
                    << a;
        key_[i] = code;
        order_[i] = static_cast<std::uint32_t>(i);
    }
    for (int shift = 0; shift < 30; shift += 10) {  // radix sort, stable: three passes of 10 bits
        histogram_.assign(1025, 0);
        for (std::size_t i = 0; i < n; ++i) ++histogram_[((key_[i] >> shift) & 1023u) + 1];
        for (std::size_t b = 0; b < 1024; ++b) histogram_[b + 1] += histogram_[b];
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t to = histogram_[(key_[i] >> shift) & 1023u]++;
            key_other_[to] = key_[i];
            order_other_[to] = order_[i];
        }
        key_.swap(key_other_);
        order_.swap(order_other_);
    }
}

void BroadPhase::build_tree(std::span<const Box> boxes, int threads) {
    sort_by_place(boxes, threads);
    std::size_t used = 0;
    for (std::size_t count = boxes.size(); used == 0 || count > 1; count = levels_[used++].size()) {
        if (levels_.size() == used) levels_.emplace_back();
        std::vector<BoxBlock>& level = levels_[used];
        level.resize((count + 15) / 16);
        const BoxBlock* below = used > 0 ? levels_[used - 1].data() : nullptr;
        const auto box_of = [&](std::size_t i) {
            if (i >= count) return Box{{kEmpty, kEmpty, kEmpty, -kEmpty, -kEmpty, -kEmpty}};
            return below == nullptr ? boxes[order_[i]] : around(below[i]);
        };
#pragma omp parallel for num_threads(threads) schedule(static)
        for (std::size_t p = 0; p < level.size(); ++p)
            for (std::size_t l = 0; l < 16; ++l) {
                const Box box = box_of(16 * p + l);
                for (int k = 0; k < 6; ++k) level[p].bound[k][l] = box.bound[k];
            }
        tree_.level[used] = level.data();
    }
    tree_.level_count = static_cast<std::uint32_t>(used);
    tree_.index = order_.data();
}

void BroadPhase::find_pairs(std::span<const Box> boxes, int threads, std::vector<BoxPair>& pairs,
                            BroadPhaseMethod method, InstructionSet instruction_set) {
    pairs.clear();
    const std::size_t n = boxes.size();
    if (n < 2) return;
    const bool grid = method != BroadPhaseMethod::tree && build_grid(boxes, threads);
    if (!grid) build_tree(boxes, threads);

    const SearchKernels& kernels = search_kernels(instruction_set);
    const std::size_t chunks = (n + kChunk - 1) / kChunk;
    if (found_.size() < chunks) found_.resize(chunks);
    first_.assign(chunks + 1, 0);
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (std::size_t c = 0; c < chunks; ++c) {
        const auto begin = static_cast<std::uint32_t>(c * kChunk);
        const auto end = static_cast<std::uint32_t>(std::min<std::size_t>(n, begin + kChunk));
        std::vector<BoxPair>& found = found_[c];
        PairSink sink{found.data(), found.data() + found.size(), grow, &found};
        if (grid)
            kernels.search_grid(grid_, begin, end, sink);
        else
            kernels.search_tree(tree_, begin, end, sink);
        first_[c + 1] = static_cast<std::size_t>(sink.at - found.data());
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    pairs.resize(first_[chunks]);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t c = 0; c < chunks; ++c)
        std::copy_n(found_[c].begin(), first_[c + 1] - first_[c],
                    pairs.begin() + static_cast<std::ptrdiff_t>(first_[c]));
}

}  // namespace keratin
