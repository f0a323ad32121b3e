// Before the small steps of a block: where its roots go, the masses, and the factors of the bending
// system, which depend on the rest shape and the step alone.
#pragma once

#include "runtime/formula/bend.h"
#include "runtime/formula/interpolate.h"
#include "runtime/formula/length.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {

inline void prepare_root(const Part<Work> b, std::size_t lane, const float* transform,
                         std::size_t stride, std::uint32_t slot) {
    const float* p = transform + lane / kTileLanes * stride + lane % kTileLanes;
    const auto at = [&](std::size_t c) { return load<Work>(p + c * kTileLanes, stride); };
    const Vec4<Work> q(at(0), at(1), at(2), at(3));
    const Work3 t(at(4), at(5), at(6));
    b.set_root3(slot, carried(q, t, b.rest(0)));
    b.set_root3(slot + 3, carried(q, t, b.rest(1)));
    b.set_root3(slot + 6, rotate(q, b.shape(0)));
}

// L D L^T of the pentadiagonal matrix M + (1 + damping) (A^T K A + S): joint i has the row
// (lever_i, -(1 + lever_i), 1) on the points i-1, i, i+1; the unknowns are the points 2 .. n. The
// exact row of a joint is this row plus t (g.da) / |a|, da the change of the parent; S = share k |g
// across t|^2 / |a|^2 on da stands for that. A step with an approximate matrix is stable when the
// matrix is at least three quarters of the true one; with share 1 curls are so by themselves, but
// not together with the length passes, which move points in the same directions: 10 is where
// strands of any stiffness and 65 degrees of curl a joint came to rest in trials, 3 was not enough.
// What is in the matrix and not elastic acts on the motion before the solve too (predict.h), or it
// is mass, and strands flutter on it. All pivots are at least the mass in exact arithmetic;
// rounding is kept from going below.
inline constexpr float kSweepShareValue = 10;

inline void prepare_bending(const Part<Work> b, const QuadClass& group, bool bends) {
    const std::size_t n = b.rows - 1;
    const Work zero(0.0f), one(1.0f);
    const Work stiffness(group.stiffness_step);

    const Work kSweepShare(kSweepShareValue), total(1.0f + group.bend_damping);
    struct Joint {
        Work elastic, k, lever, sweep, carries;
    };
    const auto joint = [&](std::size_t i) {
        if (i >= n || !bends) return Joint{zero, zero, zero, zero, one};
        const Work parent = b.length(i);
        const Work half = i == 1 ? zero : Work(0.5f) * parent;
        const Work elastic = bend_stiffness(stiffness, half, b.length(i + 1));
        const Work k = elastic * total;
        const Work3 edge = b.edge(i), child = b.edge(i + 1);
        return Joint{elastic, k, bend_lever(edge, child),
                     k * kSweepShare * bend_sweep(edge, child),
                     carried_weight(stiffness, half, b.length(i + 1))};
    };

    Joint below = joint(1), here = joint(2);
    b.set(slot_stiffness, 1, below.elastic);
    b.set(slot_lever, 1, below.lever);
    b.set(slot_drag, 1, below.sweep);
    Work beyond = zero;
    for (std::size_t i = 2; i <= n; ++i) beyond = beyond + b.length(i);
    // The weight beyond a segment holds it upright too, as far as it hangs; without tension nothing
    // carries that weight.
    const Work3 weight = splat<Work>(group.weight_step) * Work(group.held);
    Work3 x = b.x(1);
    const auto swing = [&](std::size_t i, const Work& l, const Work& far) {
        const Work3 next = b.x(i);
        const Work hangs = dot(next - x, weight);
        x = next;
        return weight_stiffness(hangs, max(far, zero), l);
    };
    Work swing_here =
        swing(2, b.length(2), (beyond - Work(0.5f) * b.length(2)) * below.carries);
    b.set(slot_inverse_length, 1, one / max(b.length(1), Work(1e-12f)));
    // The clamp's direction is the root frame's first axis.
    if (bends) b.set(slot_along, 1, b.edge(2).x);
    Work inverse1 = zero, inverse2 = zero;  // 1 / D of the two rows before
    Work band1 = zero;                      // L1 of the row before
    Work mass_length = b.length(2);
    for (std::size_t i = 2; i <= n; ++i) {
        const Joint above = joint(i + 1);
        const Work next_length = i < n ? b.length(i + 1) : zero;
        const Work w = inverse_point_mass(mass_length, next_length);
        b.set(slot_inverse_mass, i, w);
        const Work there = Work(0.5f) * (mass_length + next_length);
        const auto none = w < Work(1e-20f);
        const Work m = select(none, one, there);
        beyond = beyond - Work(0.5f) * mass_length;
        b.set(slot_beyond, i, beyond * below.carries);
        beyond = beyond - Work(0.5f) * mass_length;
        const Work inverse_length = one / max(mass_length, Work(1e-12f));
        b.set(slot_inverse_length, i, inverse_length);
        if (bends && i < n) b.set(slot_along, i, dot(b.edge(i), b.edge(i + 1)) * inverse_length);
        mass_length = next_length;

        const Work swing_next =
            i < n ? swing(i + 1, next_length, (beyond - Work(0.5f) * next_length) * here.carries)
                  : zero;
        const Work far = one + here.lever;
        const Work a = m + below.k + here.k * (far * far) + above.k * (above.lever * above.lever) +
                       here.sweep + above.sweep + swing_here + swing_next;
        Work off1 = zero, off2 = zero;
        if (i >= 3)
            off1 = -(below.k * (one + below.lever)) - here.k * (here.lever * far) - here.sweep -
                   swing_here;
        swing_here = swing_next;
        if (i >= 4) off2 = below.k * below.lever;
        const Work coupled = off1 - off2 * band1;
        const Work l1 = coupled * inverse1;
        const Work l2 = off2 * inverse2;
        const Work d = max(a - l1 * coupled - l2 * off2, m);
        const Work inverse = one / d;
        b.set(slot_stiffness, i, here.elastic);
        b.set(slot_lever, i, here.lever);
        b.set(slot_drag, i, here.sweep);
        b.set(slot_pivot, i, inverse);
        b.set(slot_band1, i, l1);
        b.set(slot_band2, i, l2);
        inverse2 = inverse1;
        inverse1 = inverse;
        band1 = l1;
        below = here;
        here = above;
    }
}

inline void prepare_block(const Quad& quad, std::size_t block) {
    for (std::size_t lane = block; lane < block + kBlockLanes; lane += kWorkLanes) {
        const Part<Work> b(quad, lane);
        prepare_root(b, lane, quad.root_begin, quad.root_stride, root_begin);
        prepare_root(b, lane, quad.root_end, quad.root_stride, root_end);
        prepare_bending(b, *quad.group, quad.flags.local_shape);
    }
}

}  // namespace keratin::KERATIN_ISA
