// Points in a uniform grid of values: the cells of a pack, and what stands between a cell's
// corners. Corners are numbered x + 2 y + 4 z.
#pragma once

#include "runtime/formula/grid.h"
#include "runtime/pass/work.h"

#include <bit>

namespace keratin::KERATIN_ISA {

template <class Pack>
struct GridCells {
    static constexpr std::size_t kLanes = Pack::kLanes;

    decltype(Pack() < Pack()) inside;  // lanes that lie in the grid
    Pack share[3];                     // of the way to the next value along each axis
    // Of the lowest corner; of the grid's first cell for lanes outside.
    alignas(64) std::uint32_t cell[3][kLanes];

    // Values stand at origin + spacing * (0 .. last).
    KERATIN_ALWAYS_INLINE GridCells(const float (&origin)[3], float inverse_spacing,
                                    const std::uint32_t (&last)[3], const Vec3<Pack>& x) {
        const Pack position[3] = {x.x, x.y, x.z}, zero(0.0f);
        Pack whole[3];
        for (int c = 0; c < 3; ++c) {
            const Pack s = (position[c] - Pack(origin[c])) * Pack(inverse_spacing);
            whole[c] = floor_of(s);
            share[c] = s - whole[c];
            // Comparisons that not-a-number fails.
            const auto in = (Pack(-0.5f) < whole[c]) & (whole[c] < Pack(float(last[c])));
            inside = c > 0 ? inside & in : in;
        }
        for (int c = 0; c < 3; ++c) {
            share[c] = select(inside, share[c], zero);
            alignas(64) float known[kLanes];
            store(select(inside, whole[c], zero), known, kTileLanes);
            for (std::size_t l = 0; l < kLanes; ++l)
                cell[c][l] = std::uint32_t(std::int32_t(known[l]));
        }
    }
};

// Calls body(l) for each lane that is set.
template <class Mask, class Body>
KERATIN_ALWAYS_INLINE void for_each_lane(const Mask& mask, Body&& body) {
    for (unsigned long long left = lane_bits(mask); left != 0; left &= left - 1)
        body(std::size_t(std::countr_zero(left)));
}

// The value between the corners v of a cell, at the shares f of the way, and its gradient times the
// spacing.
template <class Real>
KERATIN_ALWAYS_INLINE Real trilinear(const Real (&v)[8], const Real (&f)[3], Vec3<Real>& gradient) {
    const auto mix = [](const Real& a, const Real& b, const Real& s) { return a + (b - a) * s; };
    const Real y00 = mix(v[0], v[1], f[0]), y10 = mix(v[2], v[3], f[0]);
    const Real y01 = mix(v[4], v[5], f[0]), y11 = mix(v[6], v[7], f[0]);
    const Real z0 = mix(y00, y10, f[1]), z1 = mix(y01, y11, f[1]);
    const Real x0 = mix(v[1] - v[0], v[3] - v[2], f[1]), x1 = mix(v[5] - v[4], v[7] - v[6], f[1]);
    gradient = Vec3<Real>(mix(x0, x1, f[2]), mix(y10 - y00, y11 - y01, f[2]), z1 - z0);
    return mix(z0, z1, f[2]);
}

}  // namespace keratin::KERATIN_ISA
