// Two sweeps, from root to tip and back, that turn the tension of all segments (tense.h) into moves
// of the points.
//
// Joints answer to tension as they answer to their own moments, with the bending system: the moves
// are (M + K)^-1 of the forces, K and its damping as in prepare.h. By their masses alone the points of
// a strand that is bent at the scale of its segments would give way sideways, which is the shortest
// way to the right lengths; where joints are stiff that undoes what bending straightened or throws
// points to the other side, and a strand that was once folded lashes about for ever. The tension
// itself is that of the masses alone; the exact lengths that follow make up for what is missing.
#pragma once

#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {

// Leaves the moves where the directions of the segments were.
template <bool shape, class Pack>
void yield_to_tension(const Part<Pack> b) {
    using Pack3 = Vec3<Pack>;
    const std::size_t n = b.rows - 1;
    const Pack zero(0.0f);
    const Pack3 none(zero, zero, zero);
    Pack lambda = b.get(slot_sweep1, 2);
    Pack3 tug = b.get3(slot_x, 2) * lambda;  // tension of the segment to the parent, along it
    Pack3 y1 = none, y2 = none;
    for (std::size_t i = 2; i <= n; ++i) {
        Pack3 force = none - tug;
        if (i < n) {
            lambda = b.get(slot_sweep1, i + 1) + b.get(slot_sweep2, i + 1) * lambda;
            tug = b.get3(slot_x, i + 1) * lambda;
            force += tug;
        }
        if constexpr (shape) {
            const Pack3 y = force - y2 * b.get(slot_band2, i) - y1 * b.get(slot_band1, i);
            b.set3(slot_x, i, y);
            y2 = y1;
            y1 = y;
        } else {
            b.set3(slot_x, i, force * b.get(slot_inverse_mass, i));
        }
    }
    if constexpr (!shape) return;
    Pack3 d1 = none, d2 = none;
    Pack l1 = zero, l2 = zero, l2_next = zero;
    for (std::size_t j = n; j >= 2; --j) {
        const Pack3 d = b.get3(slot_x, j) * b.get(slot_pivot, j) - d2 * l2 - d1 * l1;
        b.set3(slot_x, j, d);
        d2 = d1;
        d1 = d;
        l2 = l2_next;
        l1 = b.get(slot_band1, j);
        l2_next = b.get(slot_band2, j);
    }
}

}  // namespace keratin::KERATIN_ISA
