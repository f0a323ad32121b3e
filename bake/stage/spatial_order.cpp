#include "bake/stage/spatial_order.h"

#include <algorithm>
#include <bit>

namespace keratin {
namespace {

// Ascending runs while the prefix doubles.
constexpr std::uint32_t kRuns = 16;

std::uint64_t spread_bits(std::uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

std::uint32_t reverse_bits(std::uint32_t x, std::uint32_t bits) {
    std::uint32_t out = 0;
    for (std::uint32_t b = 0; b < bits; ++b) out |= ((x >> b) & 1u) << (bits - 1 - b);
    return out;
}

}  // namespace

std::vector<std::uint64_t> morton_keys(std::span<const Vec3> points) {
    std::vector<std::uint64_t> keys(points.size());
    if (points.empty()) return keys;
    Vec3 low = points.front(), high = points.front();
    for (const Vec3& p : points) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    const double size = (high - low).maxCoeff();
    const double scale = size > 0 ? 2097151.0 / size : 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 q = (points[i] - low) * scale;
        keys[i] = spread_bits(static_cast<std::uint64_t>(q.x())) |
                  spread_bits(static_cast<std::uint64_t>(q.y())) << 1 |
                  spread_bits(static_cast<std::uint64_t>(q.z())) << 2;
    }
    return keys;
}

std::vector<std::uint32_t> prefix_uniform_order(std::uint32_t count) {
    std::vector<std::uint32_t> out;
    out.reserve(count);
    if (count == 0) return out;
    const auto bits = static_cast<std::uint32_t>(std::bit_width(count - 1));
    out.push_back(0);
    for (std::uint32_t level = 0; level < bits; ++level) {
        // Bit-reversed numbers [2^level, 2^(level+1)) halve the gaps between those before; any
        // block of them whose size is a power of two is evenly spaced itself.
        const std::uint64_t begin = std::uint64_t{1} << level;
        const std::uint64_t run = std::max<std::uint64_t>(1, begin / kRuns);
        for (std::uint64_t first = begin; first < 2 * begin; first += run) {
            const std::size_t sorted_from = out.size();
            for (std::uint64_t i = first; i < first + run; ++i) {
                const std::uint32_t k = reverse_bits(static_cast<std::uint32_t>(i), bits);
                if (k < count) out.push_back(k);
            }
            std::sort(out.begin() + static_cast<std::ptrdiff_t>(sorted_from), out.end());
        }
    }
    return out;
}

}  // namespace keratin
