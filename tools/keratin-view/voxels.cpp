#include "tools/keratin-view/voxels.h"

#include "tools/keratin-view/float3.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>

namespace keratin::view {
namespace {

Float3 load(std::span<const float> values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

// The eight voxels around a point and its share in each. Voxel numbers wrap after 2^21 along an
// axis.
struct Corners {
    std::array<std::uint64_t, 8> voxel;
    std::array<double, 8> weight;
};
Corners corners(Float3 p, float spacing) {
    const double at[3] = {p.x / spacing, p.y / spacing, p.z / spacing};
    Corners out;
    for (int k = 0; k < 8; ++k) {
        out.weight[k] = 1;
        out.voxel[k] = 0;
        for (int c = 0; c < 3; ++c) {
            const double low = std::floor(at[c]), upper = at[c] - low;
            const bool next = k >> c & 1;
            out.weight[k] *= next ? upper : 1 - upper;
            const auto index = std::uint64_t(std::int64_t(low) + next) & 0x1fffff;
            out.voxel[k] |= index << (21 * c);
        }
    }
    return out;
}

}  // namespace

VoxelValues voxel_values(const SubjectStrands& strands, std::span<const float> velocity,
                         float spacing) {
    struct Voxel {
        double volume = 0;             // m^3 of hair
        std::array<double, 3> flow{};  // m^4/s
    };
    std::unordered_map<std::uint64_t, Voxel> voxels;
    const std::size_t count = strands.position.size() / 3;
    for (std::size_t s = 0; s + 1 < strands.first_point.size(); ++s) {
        const std::uint32_t first = strands.first_point[s], end = strands.first_point[s + 1];
        const double area = std::numbers::pi * strands.radius[s] * strands.radius[s];
        for (std::uint32_t p = first; p < end; ++p) {
            double half_lengths = 0;
            if (p > first)
                half_lengths +=
                    0.5 * length(load(strands.position, p) - load(strands.position, p - 1));
            if (p + 1 < end)
                half_lengths +=
                    0.5 * length(load(strands.position, p + 1) - load(strands.position, p));
            const Corners around = corners(load(strands.position, p), spacing);
            for (int k = 0; k < 8; ++k) {
                Voxel& voxel = voxels[around.voxel[k]];
                const double volume = area * half_lengths * around.weight[k];
                voxel.volume += volume;
                if (!velocity.empty())
                    for (int c = 0; c < 3; ++c) voxel.flow[c] += volume * velocity[3 * p + c];
            }
        }
    }
    VoxelValues values;
    values.velocity.resize(3 * count);
    values.share.resize(count);
    const double voxel_volume = double(spacing) * spacing * spacing;
    for (std::size_t p = 0; p < count; ++p) {
        const Corners around = corners(load(strands.position, p), spacing);
        double volume = 0;
        std::array<double, 3> flow{};
        for (int k = 0; k < 8; ++k) {
            const auto found = voxels.find(around.voxel[k]);
            if (found == voxels.end()) continue;
            volume += around.weight[k] * found->second.volume;
            for (int c = 0; c < 3; ++c) flow[c] += around.weight[k] * found->second.flow[c];
        }
        values.share[p] = float(volume / voxel_volume);
        for (int c = 0; c < 3; ++c)
            values.velocity[3 * p + c] = volume > 0 ? float(flow[c] / volume) : 0;
    }
    return values;
}

float voxel_spacing(const SubjectStrands& strands) {
    constexpr float infinity = std::numeric_limits<float>::infinity(), across = 48;
    Float3 low{infinity, infinity, infinity}, high = -low;
    for (std::size_t i = 0; i < strands.position.size() / 3; ++i) {
        const Float3 p = load(strands.position, i);
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const float longest = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    return longest > 0 ? longest / across : 1 / across;
}

Result<void> add_voxel_values(const Source& source, std::size_t i, Subject& subject) {
    std::vector<float> velocity = std::move(subject.hair.velocity);
    if (velocity.empty() && source.cache && source.cache->frame_count() > 1) {
        const auto other = source.cache->frame(i > 0 ? i - 1 : 1);
        if (!other) return other.error();
        velocity.resize(subject.hair.position.size());
        const double between = subject.time - other->time;
        for (std::size_t k = 0; k < velocity.size(); ++k)
            velocity[k] =
                float((double(subject.hair.position[k]) - other->strand_position[k]) / between);
    }
    VoxelValues values = voxel_values(subject.hair, velocity, voxel_spacing(subject.hair));
    if (!velocity.empty()) subject.hair.velocity = std::move(values.velocity);
    if (subject.hair.density.empty()) {
        subject.hair.density = std::move(values.share);
        subject.density_unit = "of the space";
    }
    return {};
}

}  // namespace keratin::view
