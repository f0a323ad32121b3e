#include "bake/stage/order.h"

#include "bake/stage/spatial_order.h"

#include <algorithm>
#include <iterator>
#include <numeric>

namespace keratin {

AssetOrder order_asset(const Groom& groom, std::span<const std::uint32_t> guides) {
    constexpr std::size_t kQuadLanes = kQuadTiles * kTileLanes;
    const std::size_t n = groom.strand_count();
    std::vector<Vec3> roots(n);
#pragma omp parallel for schedule(static)
    for (std::size_t s = 0; s < n; ++s) roots[s] = groom.points(s).front();
    // Group by group, along the curve in each.
    std::vector<std::size_t> next(groom.group_names.size() + 1, 0);
    for (std::uint32_t g : groom.group) ++next[g + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<std::uint32_t> along(n);
    for (std::uint32_t s : morton_order(roots)) along[next[groom.group[s]]++] = s;
    AssetOrder out;
    out.strand.reserve(n);
    out.new_strand.resize(n);
    for (std::uint32_t i : prefix_uniform_order(static_cast<std::uint32_t>(n))) {
        out.new_strand[along[i]] = static_cast<std::uint32_t>(out.strand.size());
        out.strand.push_back(along[i]);
    }

    // The longest of a group first, equals along the curve.
    std::vector<std::uint8_t> is_guide(n, 0);
    for (std::uint32_t s : guides) is_guide[s] = 1;
    std::vector<std::uint32_t> sorted;
    sorted.reserve(guides.size());
    std::copy_if(along.begin(), along.end(), std::back_inserter(sorted),
                 [&](std::uint32_t s) { return is_guide[s]; });
    std::stable_sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
        if (groom.group[a] != groom.group[b]) return groom.group[a] < groom.group[b];
        return groom.point_count(a) > groom.point_count(b);
    });
    out.lane_of.assign(n, kNoStrand);
    out.tile_first_row.push_back(0);
    for (std::size_t begin = 0; begin < sorted.size();) {
        const std::uint32_t group = groom.group[sorted[begin]];
        std::size_t end = begin;
        while (end < sorted.size() && end < begin + kQuadLanes &&
               groom.group[sorted[end]] == group) {
            ++end;
        }
        const auto rows = static_cast<std::uint32_t>(groom.point_count(sorted[begin]));
        for (std::size_t i = begin; i < end; ++i) {
            out.lane_of[sorted[i]] = static_cast<std::uint32_t>(out.lane_strand.size() + i - begin);
        }
        out.lane_strand.insert(out.lane_strand.end(),
                               sorted.begin() + static_cast<std::ptrdiff_t>(begin),
                               sorted.begin() + static_cast<std::ptrdiff_t>(end));
        out.lane_strand.resize(out.lane_strand.size() + kQuadLanes - (end - begin), kNoStrand);
        out.lane_group.resize(out.lane_strand.size(), group);
        for (std::size_t t = 0; t < kQuadTiles; ++t) {
            out.tile_first_row.push_back(out.tile_first_row.back() + rows);
        }
        begin = end;
    }
    return out;
}

}  // namespace keratin
