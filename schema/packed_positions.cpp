#include "schema/packed_positions.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

constexpr int kLargest = 32767;
// Strands smaller than this (m) are points; keeps steps normal numbers.
constexpr float kSmallestExtent = 1e-20f;

float step_for(float extent) {
    int exponent = 0;
    // extent / kLargest = fraction * 2^exponent with fraction in [1/2, 1).
    std::frexp(std::max(extent, kSmallestExtent) / float(kLargest), &exponent);
    return std::ldexp(1.0f, exponent);
}

}  // namespace

PackedPositions pack_positions(std::span<const std::uint32_t> first_point,
                               std::span<const float> position) {
    const std::size_t strands = first_point.size() - 1;
    PackedPositions out;
    out.packed.assign(packed_words(position.size() / 3), 0);
    out.root.reserve(3 * strands);
    out.step.reserve(strands);
    for (std::size_t s = 0; s < strands; ++s) {
        const std::size_t begin = 3 * std::size_t{first_point[s]};
        const std::size_t end = 3 * std::size_t{first_point[s + 1]};
        float extent = 0;
        for (std::size_t i = begin; i < end; ++i)
            extent = std::max(extent, std::abs(position[i] - position[begin + (i - begin) % 3]));
        const float step = step_for(extent);
        out.root.insert(out.root.end(), &position[begin], &position[begin] + 3);
        out.step.push_back(step);
        for (std::size_t i = begin; i < end; ++i) {
            const float steps = (position[i] - position[begin + (i - begin) % 3]) / step;
            const long number = std::clamp<long>(std::lround(steps), -kLargest, kLargest);
            out.packed[i / 2] |= (static_cast<std::uint32_t>(number) & 0xffffu) << (16 * (i % 2));
        }
    }
    return out;
}

void unpack_positions(std::span<const std::uint32_t> first_point,
                      std::span<const std::uint32_t> packed, std::span<const float> root,
                      std::span<const float> step, std::span<float> position) {
    for (std::size_t s = 0; s + 1 < first_point.size(); ++s) {
        const std::size_t begin = 3 * std::size_t{first_point[s]};
        const std::size_t end = 3 * std::size_t{first_point[s + 1]};
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t word = packed[i / 2] >> (16 * (i % 2));
            const auto number = static_cast<std::int16_t>(word & 0xffffu);
            position[i] = root[3 * s + (i - begin) % 3] + step[s] * float(number);
        }
    }
}

}  // namespace keratin
