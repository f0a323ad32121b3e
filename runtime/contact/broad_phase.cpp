#include "runtime/contact/broad_phase.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace keratin {
namespace {

constexpr std::size_t kGridMost = 100'000;  // boxes; the tree is faster above
constexpr std::uint32_t kChunk = 1024;      // boxes a thread takes at a time
constexpr float kEmpty = std::numeric_limits<float>::infinity();

struct Query {
    float low_x, low_y, low_z, high_x, high_y, high_z;
};

struct BoxArrays {
    const float *low_x, *low_y, *low_z, *high_x, *high_y, *high_z;
};

struct GridView {
    BoxArrays b;
    const std::uint32_t *start, *index;
    float low[3], inverse[3], largest[3];
    int cells[3];
    int row(float x, int axis) const {
        const float c = (x - low[axis]) * inverse[axis];
        return c <= 0                                 ? 0
               : c >= static_cast<float>(cells[axis]) ? cells[axis] - 1
                                                      : static_cast<int>(c);
    }
};

constexpr int kMostLevels = 8;  // 16^8 = 2^32 boxes

struct TreeView {
    BoxArrays level[kMostLevels];
    std::uint32_t level_count;  // the root is node 0 of level level_count
    const std::uint32_t* index;
};

void emit(std::uint32_t i, std::uint32_t j, std::vector<BoxPair>& out) {
    out.push_back(i < j ? BoxPair{i, j} : BoxPair{j, i});
}

#define KERATIN_QUERY_TARGET
#define KERATIN_QUERY_NAME(name) name##_baseline
std::uint32_t overlap16_baseline(const BoxArrays& b, std::uint32_t i, const Query& q) {
    std::uint32_t mask = 0;
    for (std::uint32_t l = 0; l < 16; ++l)
        mask |=
            static_cast<std::uint32_t>((b.low_x[i + l] <= q.high_x) & (b.high_x[i + l] >= q.low_x) &
                                       (b.low_y[i + l] <= q.high_y) & (b.high_y[i + l] >= q.low_y) &
                                       (b.low_z[i + l] <= q.high_z) & (b.high_z[i + l] >= q.low_z))
            << l;
    return mask;
}
#include "runtime/contact/broad_phase_query.inc"
#undef KERATIN_QUERY_TARGET
#undef KERATIN_QUERY_NAME

#if defined(__x86_64__)
#define KERATIN_QUERY_TARGET [[gnu::target("avx2")]]
#define KERATIN_QUERY_NAME(name) name##_avx2
KERATIN_QUERY_TARGET inline std::uint32_t overlap16_avx2(const BoxArrays& b, std::uint32_t i,
                                                         const Query& q) {
    std::uint32_t mask = 0;
    for (int half = 0; half < 2; ++half, i += 8) {
        __m256 m =
            _mm256_cmp_ps(_mm256_loadu_ps(b.low_x + i), _mm256_set1_ps(q.high_x), _CMP_LE_OQ);
        m = _mm256_and_ps(
            m, _mm256_cmp_ps(_mm256_loadu_ps(b.high_x + i), _mm256_set1_ps(q.low_x), _CMP_GE_OQ));
        m = _mm256_and_ps(
            m, _mm256_cmp_ps(_mm256_loadu_ps(b.low_y + i), _mm256_set1_ps(q.high_y), _CMP_LE_OQ));
        m = _mm256_and_ps(
            m, _mm256_cmp_ps(_mm256_loadu_ps(b.high_y + i), _mm256_set1_ps(q.low_y), _CMP_GE_OQ));
        m = _mm256_and_ps(
            m, _mm256_cmp_ps(_mm256_loadu_ps(b.low_z + i), _mm256_set1_ps(q.high_z), _CMP_LE_OQ));
        m = _mm256_and_ps(
            m, _mm256_cmp_ps(_mm256_loadu_ps(b.high_z + i), _mm256_set1_ps(q.low_z), _CMP_GE_OQ));
        mask |= static_cast<std::uint32_t>(_mm256_movemask_ps(m)) << (8 * half);
    }
    return mask;
}
#include "runtime/contact/broad_phase_query.inc"
#undef KERATIN_QUERY_TARGET
#undef KERATIN_QUERY_NAME

#define KERATIN_QUERY_TARGET [[gnu::target("avx512f")]]
#define KERATIN_QUERY_NAME(name) name##_avx512
KERATIN_QUERY_TARGET inline std::uint32_t overlap16_avx512(const BoxArrays& b, std::uint32_t i,
                                                           const Query& q) {
    __mmask16 m =
        _mm512_cmp_ps_mask(_mm512_loadu_ps(b.low_x + i), _mm512_set1_ps(q.high_x), _CMP_LE_OQ);
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(b.high_x + i), _mm512_set1_ps(q.low_x),
                                _CMP_GE_OQ);
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(b.low_y + i), _mm512_set1_ps(q.high_y),
                                _CMP_LE_OQ);
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(b.high_y + i), _mm512_set1_ps(q.low_y),
                                _CMP_GE_OQ);
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(b.low_z + i), _mm512_set1_ps(q.high_z),
                                _CMP_LE_OQ);
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(b.high_z + i), _mm512_set1_ps(q.low_z),
                                _CMP_GE_OQ);
    return m;
}
#include "runtime/contact/broad_phase_query.inc"
#undef KERATIN_QUERY_TARGET
#undef KERATIN_QUERY_NAME
#endif

enum class Isa { baseline, avx2, avx512 };

Isa pick_isa() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) return Isa::avx512;
    if (__builtin_cpu_supports("avx2")) return Isa::avx2;
#endif
    return Isa::baseline;
}

template <class View, class Baseline, class Avx2, class Avx512>
void run_query(Isa isa, const View& view, std::uint32_t begin, std::uint32_t end,
               std::vector<BoxPair>& out, Baseline baseline, Avx2 avx2, Avx512 avx512) {
    if (isa == Isa::avx512) return avx512(view, begin, end, out);
    if (isa == Isa::avx2) return avx2(view, begin, end, out);
    baseline(view, begin, end, out);
}

#if !defined(__x86_64__)
constexpr auto query_grid_avx2 = query_grid_baseline, query_grid_avx512 = query_grid_baseline;
constexpr auto query_tree_avx2 = query_tree_baseline, query_tree_avx512 = query_tree_baseline;
#endif

// Spreads the low 10 bits so that two zero bits follow each.
std::uint32_t spread(std::uint32_t x) {
    x = (x | (x << 16)) & 0x030000FFu;
    x = (x | (x << 8)) & 0x0300F00Fu;
    x = (x | (x << 4)) & 0x030C30C3u;
    x = (x | (x << 2)) & 0x09249249u;
    return x;
}

}  // namespace

void BroadPhase::Sorted::fill(const BoxBounds& boxes, std::span<const std::uint32_t> order,
                              int threads) {
    const std::size_t n = order.size();
    for (std::vector<float>* v : {&low_x, &low_y, &low_z, &high_x, &high_y, &high_z})
        v->resize(n + 16);
    index.assign(order.begin(), order.end());
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t o = order[i];
        low_x[i] = boxes.low_x[o], low_y[i] = boxes.low_y[o], low_z[i] = boxes.low_z[o];
        high_x[i] = boxes.high_x[o], high_y[i] = boxes.high_y[o], high_z[i] = boxes.high_z[o];
    }
    for (std::size_t i = n; i < n + 16; ++i) {
        low_x[i] = low_y[i] = low_z[i] = kEmpty;
        high_x[i] = high_y[i] = high_z[i] = -kEmpty;
    }
}

// False when the boxes differ so much in size that a grid would search most of itself.
bool BroadPhase::build_grid(const BoxBounds& boxes, int threads) {
    const std::size_t n = boxes.size();
    const std::span<const float> low[3] = {boxes.low_x, boxes.low_y, boxes.low_z};
    const std::span<const float> high[3] = {boxes.high_x, boxes.high_y, boxes.high_z};
    constexpr float kLargestOverMean = 8;  // beyond it the searched rows are mostly empty
    constexpr double kCellsOverBoxes = 4;  // bounds the memory of a thinly filled grid
    double cells_total = 1;
    float size[3];
    for (int a = 0; a < 3; ++a) {
        float least = low[a][0], most = low[a][0], largest = 0;
        double sum = 0;
        for (std::size_t i = 0; i < n; ++i) {
            least = std::min(least, low[a][i]);
            most = std::max(most, low[a][i]);
            const float extent = high[a][i] - low[a][i];
            largest = std::max(largest, extent);
            sum += extent;
        }
        const float mean = static_cast<float>(sum / static_cast<double>(n));
        if (largest > kLargestOverMean * mean) return false;
        cell_low_[a] = least;
        // The search subtracts it from a bound: both roundings must stay on the safe side.
        largest_[a] = largest * 1.0001f + 4e-7f * std::max(std::fabs(least), std::fabs(most));
        size[a] =
            std::max({largest, mean, (most - least) * 1e-3f, std::numeric_limits<float>::min()});
        cells_total *= (most - least) / size[a] + 1;
        cells_[a] = 0;
        cell_inverse_[a] = most - least;
    }
    const double limit = kCellsOverBoxes * static_cast<double>(n) + 64;
    const float grow =
        cells_total > limit ? static_cast<float>(std::cbrt(cells_total / limit)) : 1.0f;
    for (int a = 0; a < 3; ++a) {
        const float range = cell_inverse_[a];
        cells_[a] = static_cast<int>(range / (size[a] * grow)) + 1;
        cell_inverse_[a] = 1 / (size[a] * grow);
    }
    const std::size_t cells = static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2];
    if (static_cast<double>(cells) > 8 * limit) return false;

    GridView g{};
    for (int a = 0; a < 3; ++a)
        g.low[a] = cell_low_[a], g.inverse[a] = cell_inverse_[a], g.cells[a] = cells_[a];
    cell_of_.resize(n);
    cell_start_.assign(cells + 1, 0);
    for (std::size_t i = 0; i < n; ++i) {
        const int x = g.row(boxes.low_x[i], 0), y = g.row(boxes.low_y[i], 1),
                  z = g.row(boxes.low_z[i], 2);
        cell_of_[i] = static_cast<std::uint32_t>(
            (static_cast<std::size_t>(z) * cells_[1] + y) * cells_[0] + x);
        ++cell_start_[cell_of_[i] + 1];
    }
    for (std::size_t c = 0; c < cells; ++c) cell_start_[c + 1] += cell_start_[c];
    order_.resize(n);
    for (std::size_t i = n; i-- > 0;)
        order_[--cell_start_[cell_of_[i] + 1]] = static_cast<std::uint32_t>(i);
    // Each start moved down to its cell's first box, one place too high: shift back.
    for (std::size_t c = 0; c < cells; ++c) cell_start_[c] = cell_start_[c + 1];
    cell_start_[cells] = static_cast<std::uint32_t>(n);
    sorted_.fill(boxes, order_, threads);
    return true;
}

void BroadPhase::build_tree(const BoxBounds& boxes, int threads) {
    const std::size_t n = boxes.size();
    const std::span<const float> low[3] = {boxes.low_x, boxes.low_y, boxes.low_z};
    const std::span<const float> high[3] = {boxes.high_x, boxes.high_y, boxes.high_z};
    float least[3], scale[3];
    for (int a = 0; a < 3; ++a) {
        float most = low[a][0] + high[a][0];
        least[a] = most;
        for (std::size_t i = 0; i < n; ++i) {
            const float c = low[a][i] + high[a][i];
            least[a] = std::min(least[a], c);
            most = std::max(most, c);
        }
        scale[a] = most > least[a] ? 1023.0f / (most - least[a]) : 0;
    }
    key_.resize(n), key_other_.resize(n), order_.resize(n), order_other_.resize(n);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t i = 0; i < n; ++i) {
        std::uint32_t code = 0;
        for (int a = 0; a < 3; ++a)
            code |=
                spread(static_cast<std::uint32_t>((low[a][i] + high[a][i] - least[a]) * scale[a]))
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
    sorted_.fill(boxes, order_, threads);

    std::size_t count = n;
    std::size_t used = 0;
    const Sorted* below = &sorted_;
    if (levels_.capacity() < kMostLevels) levels_.reserve(kMostLevels);
    while (count > 16) {
        const std::size_t parents = (count + 15) / 16;
        if (levels_.size() == used) levels_.emplace_back();
        Sorted& level = levels_[used++];
        for (std::vector<float>* v : {&level.low_x, &level.low_y, &level.low_z})
            v->assign(parents + 16, kEmpty);
        for (std::vector<float>* v : {&level.high_x, &level.high_y, &level.high_z})
            v->assign(parents + 16, -kEmpty);
        for (std::size_t p = 0; p < parents; ++p)
            for (std::size_t i = 16 * p; i < 16 * p + 16; ++i) {  // the padding holds empty boxes
                level.low_x[p] = std::min(level.low_x[p], below->low_x[i]);
                level.low_y[p] = std::min(level.low_y[p], below->low_y[i]);
                level.low_z[p] = std::min(level.low_z[p], below->low_z[i]);
                level.high_x[p] = std::max(level.high_x[p], below->high_x[i]);
                level.high_y[p] = std::max(level.high_y[p], below->high_y[i]);
                level.high_z[p] = std::max(level.high_z[p], below->high_z[i]);
            }
        below = &level;
        count = parents;
    }
    levels_.resize(used);
}

void BroadPhase::query(std::size_t count, bool grid, int threads, std::vector<BoxPair>& pairs) {
    static const Isa isa = pick_isa();
    auto arrays = [](const Sorted& s) {
        return BoxArrays{s.low_x.data(),  s.low_y.data(),  s.low_z.data(),
                         s.high_x.data(), s.high_y.data(), s.high_z.data()};
    };
    GridView g{};
    TreeView t{};
    if (grid) {
        g = {arrays(sorted_), cell_start_.data(), sorted_.index.data(), {}, {}, {}, {}};
        for (int a = 0; a < 3; ++a) {
            g.low[a] = cell_low_[a], g.inverse[a] = cell_inverse_[a];
            g.largest[a] = largest_[a], g.cells[a] = cells_[a];
        }
    } else {
        t.level[0] = arrays(sorted_);
        for (std::size_t l = 0; l < levels_.size(); ++l) t.level[l + 1] = arrays(levels_[l]);
        t.level_count = static_cast<std::uint32_t>(levels_.size() + 1);
        t.index = sorted_.index.data();
    }
    const std::size_t chunks = (count + kChunk - 1) / kChunk;
    if (found_.size() < chunks) found_.resize(chunks);
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (std::size_t c = 0; c < chunks; ++c) {
        const std::uint32_t begin = static_cast<std::uint32_t>(c) * kChunk;
        const std::uint32_t end =
            static_cast<std::uint32_t>(std::min<std::size_t>(count, begin + kChunk));
        found_[c].clear();
        if (grid)
            run_query(isa, g, begin, end, found_[c], query_grid_baseline, query_grid_avx2,
                      query_grid_avx512);
        else
            run_query(isa, t, begin, end, found_[c], query_tree_baseline, query_tree_avx2,
                      query_tree_avx512);
    }
    std::size_t total = 0;
    for (std::size_t c = 0; c < chunks; ++c) total += found_[c].size();
    pairs.resize(total);
    total = 0;
    for (std::size_t c = 0; c < chunks; ++c) {
        std::copy(found_[c].begin(), found_[c].end(),
                  pairs.begin() + static_cast<std::ptrdiff_t>(total));
        total += found_[c].size();
    }
}

void BroadPhase::find_pairs(const BoxBounds& boxes, int threads, std::vector<BoxPair>& pairs,
                            BroadPhaseMethod method) {
    pairs.clear();
    const std::size_t n = boxes.size();
    if (n < 2) return;
    bool grid = method == BroadPhaseMethod::grid ||
                (method == BroadPhaseMethod::automatic && n <= kGridMost);
    if (grid) grid = build_grid(boxes, threads);
    if (!grid) build_tree(boxes, threads);
    query(n, grid, threads, pairs);
}

}  // namespace keratin
