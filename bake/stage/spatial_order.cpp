#include "bake/stage/spatial_order.h"

#include <algorithm>
#include <bit>

namespace keratin {
namespace {

constexpr std::uint32_t kParts = 64;
constexpr std::uint32_t kPartBits = 6;
// Below this a list is reordered as a whole.
constexpr std::uint32_t kShortList = 4 * kParts;

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

// Appends first, first + step, ... (count of them) in the order of the header.
void append(std::uint32_t first, std::uint32_t step, std::uint32_t count,
            std::vector<std::uint32_t>& out) {
    if (count <= kShortList) {
        const auto bits = static_cast<std::uint32_t>(std::bit_width(count > 1 ? count - 1 : 0u));
        for (std::uint32_t i = 0; i < (1u << bits); ++i) {
            const std::uint32_t k = reverse_bits(i, bits);
            if (k < count) out.push_back(first + k * step);
        }
        return;
    }
    for (std::uint32_t i = 0; i < kParts; ++i) {
        const std::uint32_t part = reverse_bits(i, kPartBits);
        const std::uint32_t size = (count - part + kParts - 1) / kParts;
        if (i == 0) {
            append(first, step * kParts, size, out);
        } else {
            for (std::uint32_t k = 0; k < size; ++k)
                out.push_back(first + (part + k * kParts) * step);
        }
    }
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
    append(0, 1, count, out);
    return out;
}

}  // namespace keratin
