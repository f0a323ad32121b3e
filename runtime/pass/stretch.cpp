// Segment lengths: the tension of all segments of a strand at once, and on the way out the pull of
// the global length (METHODS 1.4, stretch and global length).
//
// The linearised constraints t_i . (dx_i - dx_{i-1}) = l_i - |e_i| with dx = W grad^T lambda are a
// tridiagonal system; it is eliminated from the tip and solved from the root.
#include "runtime/formula/length.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

struct Bounds {
    Work3 low, high;
};

template <bool tension>
Bounds stretch_block(const Block& b) {
    const std::size_t n = b.rows - 1;
    const Work zero(0.0f), one(1.0f);
    const Work3 none(zero, zero, zero);

    if constexpr (tension) {
        // lambda_i = sweep1_i + sweep2_i lambda_{i-1}
        Work3 x = b.x(n), parent = b.x(n - 1);
        Work3 e = x - parent;
        Work square = dot(e, e);
        auto tiny = square < Work(1e-24f);
        Work size = sqrt(select(tiny, one, square));
        Work3 t = select(tiny, none, e * (one / size));
        Work error = select(tiny, zero, size) - b.length(n);
        Work carried_value = zero, carried_share = zero;
        Work w = b.get(slot_inverse_mass, n);
        for (std::size_t i = n; i >= 2; --i) {
            b.set3(slot_x, i, t);
            const Work w_parent = i > 2 ? b.get(slot_inverse_mass, i - 1) : zero;
            const Work d = w_parent + w - carried_share;
            const Work inverse = one / select(d < Work(1e-20f), one, d);
            const Work value = (error + carried_value) * inverse;
            b.set(slot_sweep1, i, value);
            if (i > 2) {
                const Work3 grandparent = b.x(i - 2);
                e = parent - grandparent;
                square = dot(e, e);
                tiny = square < Work(1e-24f);
                size = sqrt(select(tiny, one, square));
                const Work3 t_parent = select(tiny, none, e * (one / size));
                error = select(tiny, zero, size) - b.length(i - 1);
                const Work coupling = w_parent * dot(t_parent, t);
                const Work share = coupling * inverse;
                b.set(slot_sweep2, i, share);
                carried_value = coupling * value;
                carried_share = coupling * share;
                t = t_parent;
                parent = grandparent;
                w = w_parent;
            }
        }
    }

    const Work pull(b.quad.group->pull), damping(b.quad.group->length_damping);
    const bool pulls = b.quad.group->pull > 0;
    Work3 parent = b.x(1);
    Bounds bounds{parent, parent};
    Work lambda = zero;
    Work3 t = none;
    if constexpr (tension) {
        lambda = b.get(slot_sweep1, 2);
        t = b.get3(slot_x, 2);
    }
    for (std::size_t i = 2; i <= n; ++i) {
        Work3 x = b.x(i);
        const Work l = b.length(i);
        if constexpr (tension) {
            Work3 push = t * lambda;
            if (i < n) {
                lambda = b.get(slot_sweep1, i + 1) + b.get(slot_sweep2, i + 1) * lambda;
                t = b.get3(slot_x, i + 1);
                push = push - t * lambda;
            }
            x = x - push * b.get(slot_inverse_mass, i);
        }
        if (pulls) {
            const Work3 d = pull_to_parent(x - parent, l) * pull;
            x = x + d;
            if (i > 2) b.set_x_previous(i - 1, b.x_previous(i - 1) + d * damping);
        }
        x = select(l < Work(1e-9f), parent, x);
        b.set_x(i, x);
        parent = x;
        bounds.low = Work3(min(bounds.low.x, x.x), min(bounds.low.y, x.y), min(bounds.low.z, x.z));
        bounds.high =
            Work3(max(bounds.high.x, x.x), max(bounds.high.y, x.y), max(bounds.high.z, x.z));
    }
    return bounds;
}

}  // namespace

void stretch(Quad& quad, const SmallStep&) {
    for (std::size_t lane = 0; lane < kQuadLanes; lane += kWorkLanes) {
        const Block b(quad, lane);
        const Bounds box = quad.flags.stretch ? stretch_block<true>(b) : stretch_block<false>(b);
        const float low[3] = {lowest(box.low.x), lowest(box.low.y), lowest(box.low.z)};
        const float high[3] = {highest(box.high.x), highest(box.high.y), highest(box.high.z)};
        for (int c = 0; c < 3; ++c) {
            quad.bounds_min[c] =
                lane == 0 || low[c] < quad.bounds_min[c] ? low[c] : quad.bounds_min[c];
            quad.bounds_max[c] =
                lane == 0 || high[c] > quad.bounds_max[c] ? high[c] : quad.bounds_max[c];
        }
    }
}

}  // namespace keratin::KERATIN_ISA
