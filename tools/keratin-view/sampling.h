// Numbers that look random and are not: the same for a pixel, a sample of it and a purpose, whoever
// asks and when. Directions made from them.
#pragma once

#include "tools/keratin-view/float3.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace keratin::view {

inline std::uint32_t hash(std::uint32_t x) {  // Wellons' lowbias32
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Two numbers in [0, 1): the first two dimensions of Sobol's sequence, scrambled and shuffled for
// each pixel and purpose (Kollig & Keller 2002). `sample_mask` is one less than the number of
// samples, rounded up to a power of two.
struct Pair {
    float a, b;
};
inline Pair sample_pair(std::uint32_t pixel, std::uint32_t sample, std::uint32_t purpose,
                        std::uint32_t sample_mask) {
    const std::uint32_t seed = hash(pixel * 8 + purpose);
    std::uint32_t a = hash(seed + 1), b = hash(seed + 2);
    std::uint32_t i = sample ^ (hash(seed + 3) & sample_mask);
    for (std::uint32_t va = 1u << 31, vb = 1u << 31; i; i >>= 1, va >>= 1, vb ^= vb >> 1)
        if (i & 1) a ^= va, b ^= vb;
    constexpr float to_unit = 1.0f / (1 << 24);
    return {(a >> 8) * to_unit, (b >> 8) * to_unit};
}

// Into a disc around the unit direction `axis`, whose half angle has the tangent `spread`.
inline Float3 disc_direction(Float3 axis, float spread, Pair random) {
    const float r = spread * std::sqrt(random.a), phi = 2 * std::numbers::pi_v<float> * random.b;
    const Float3 s = perpendicular(axis), t = cross(axis, s);
    return normalized(axis + s * (r * std::cos(phi)) + t * (r * std::sin(phi)));
}

// Around the unit direction `axis`, as often as the cosine to it: the light that a surface meets.
inline Float3 cosine_direction(Float3 axis, Pair random) {
    const float r = std::sqrt(random.a), phi = 2 * std::numbers::pi_v<float> * random.b;
    const Float3 s = perpendicular(axis), t = cross(axis, s);
    return s * (r * std::cos(phi)) + t * (r * std::sin(phi)) +
           axis * std::sqrt(std::max(0.0f, 1 - random.a));
}

// Into the half space of `side` (unit, at right angles to `tangent`), as often as the sine to the
// tangent: the light that a thin cylinder meets there.
inline Float3 sine_direction(Float3 tangent, Float3 side, Pair random) {
    // The angle x to the tangent has density (2 / pi) sin^2 x; its distribution
    // (x - sin x cos x) / pi is inverted by a few Newton steps.
    constexpr float pi = std::numbers::pi_v<float>;
    float x = pi * random.a;
    for (int k = 0; k < 4; ++k) {
        const float sine = std::sin(x);
        x -= (x - sine * std::cos(x) - pi * random.a) / std::max(2 * sine * sine, 0.05f);
    }
    const float phi = pi * (random.b - 0.5f);
    return tangent * std::cos(x) +
           (side * std::cos(phi) + cross(tangent, side) * std::sin(phi)) * std::sin(x);
}

}  // namespace keratin::view
