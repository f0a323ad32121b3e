// The sweep from tip to root: the moves that bending asks for come out of the system that predict.h
// eliminated, and with the points so moved the tension of all segments of a strand is eliminated at
// once (METHODS 1.4, stretch).
//
// The linearised constraints t_i . (dx_i - dx_{i-1}) = l_i - |e_i| with dx = W grad^T lambda are a
// tridiagonal system; it is eliminated here and solved on the way back (yield.h):
//     lambda_i = sweep1_i + sweep2_i lambda_{i-1}
#pragma once

#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {

template <class Pack>
struct Box {
    Vec3<Pack> low, high;

    KERATIN_ALWAYS_INLINE void include(const Vec3<Pack>& x) {
        low = Vec3<Pack>(min(low.x, x.x), min(low.y, x.y), min(low.z, x.z));
        high = Vec3<Pack>(max(high.x, x.x), max(high.y, x.y), max(high.z, x.z));
    }
};

// Returns the box around the points where `boxed`.
template <bool shape, bool tension, bool boxed, class Pack>
[[gnu::noinline]] Box<Pack> tense(const Part<Pack> b) {
    using Pack3 = Vec3<Pack>;
    const std::size_t n = b.rows - 1;
    const Pack zero(0.0f), one(1.0f);
    const Pack3 none(zero, zero, zero);

    Pack3 d1 = none, d2 = none;  // bending's moves of the two points further out
    Pack l1 = zero, l2_next = zero, l2 = zero;
    Pack3 child = none, t_child = none;
    Pack w_child = zero, inverse = zero, value = zero;
    Pack carried_value = zero, carried_share = zero;
    Box<Pack> box{b.x(1), b.x(1)};
    for (std::size_t j = n; j >= 1; --j) {
        Pack3 x = b.x(j);
        if (j >= 2) {
            if constexpr (shape) {
                const Pack3 d = b.get3(slot_x, j) * b.get(slot_pivot, j) - d2 * l2 - d1 * l1;
                x = x + d;
                b.set_x(j, x);
                d2 = d1;
                d1 = d;
                l2 = l2_next;
                l1 = b.get(slot_band1, j);
                l2_next = b.get(slot_band2, j);
            }
            if constexpr (boxed) box.include(x);
        }
        if constexpr (tension) {
            const Pack w = j >= 2 ? b.get(slot_inverse_mass, j) : zero;
            if (j < n) {
                const std::size_t i = j + 1;  // the segment from j to i
                const Pack3 e = child - x;
                const Pack size = sqrt(max(dot(e, e), Pack(1e-24f)));
                const Pack3 t = e * (one / size);
                if (i < n) {
                    const Pack coupling = w_child * dot(t, t_child);
                    const Pack share = coupling * inverse;
                    b.set(slot_sweep2, i + 1, share);
                    carried_value = coupling * value;
                    carried_share = coupling * share;
                }
                // Below its tip a strand repeats the tip: nothing pulls there.
                inverse = select(w_child < Pack(1e-20f), zero,
                                 one / max(w + w_child - carried_share, Pack(1e-20f)));
                value = (size - b.length(i) + carried_value) * inverse;
                b.set(slot_sweep1, i, value);
                b.set3(slot_x, i, t);
                t_child = t;
            }
            child = x;
            w_child = w;
        }
    }
    return box;
}

}  // namespace keratin::KERATIN_ISA
