// The sweep from root to tip that starts a small step: points move by their inertia and the wind
// (METHODS 1.3, pass integrate); from there the elastic moments of all joints (METHODS 1.4, local
// shape, in its vector form) become the right-hand side of one implicit step, eliminated on the
// way.
//
// The source relaxes joint by joint, which at any affordable number of iterations leaves a
// stiffness that depends on the step and the number of points. With the frames taken from the
// predicted positions the moments are linear in the positions, the matrix is the same for x, y and
// z and has two bands below the diagonal; its factors come from prepare.h. So one sweep down and
// one up (tense.h) give what infinitely many iterations would, at the cost of one.
//
// Of the weight of all that lies beyond a segment only the part across it enters, and of the elastic
// forces too (bend_pull): the part along it is the segment's tension. Otherwise the solve would move
// points along the strand, the length sweeps would bring them back against other masses, and what
// both leave would bend a strand at rest and keep curls in motion. So a strand rests where weight and
// moments balance (schema/bend.h), whatever the step.
//
// Bending is damped: a joint resists the change that its row of the matrix sees in the motion since
// the small step began, taken in the frame of the root, so that a head that turns carries its hair
// along freely. The part of the matrix that stands for the sweep of curls is such a resistance too,
// never a mass.
#pragma once

#include "runtime/formula/bend.h"
#include "runtime/formula/verlet.h"
#include "runtime/formula/wind.h"
#include "runtime/pass/work.h"

#include <span>

namespace keratin::KERATIN_ISA {

enum class Air { still, moving };

// Moves point i, beside its parent's move by no more than a step can resolve; gravity 0 is left out
// of the sum, and `waves` add to the mean wind. Returns the new place, and the move for the next
// point.
template <Air air, bool falls, class Pack>
KERATIN_ALWAYS_INLINE Vec3<Pack> move_point(const Part<Pack>& b, const QuadClass& group,
                                            const SmallStep& step,
                                            [[maybe_unused]] std::span<const WindWave> waves,
                                            std::size_t i, Vec3<Pack>& parent_move) {
    using Pack3 = Vec3<Pack>;
    const Pack3 x = b.x(i), previous = b.x_previous(i);
    const Pack carry(step.step_ratio * group.keep[i]);
    Pack3 move;
    if constexpr (air == Air::still && !falls) {
        move = (x - previous) * carry;
    } else {
        Pack3 a(Pack(0.0f));
        if constexpr (falls) a = splat<Pack>(step.gravity);
        if constexpr (air != Air::still) {
            Pack3 wind = splat<Pack>(step.wind);
            for (const WindWave& w : waves)
                wind += splat<Pack>(w.direction) * wave_at(x, splat<Pack>(w.k), Pack(w.phase));
            const Pack3 velocity = (x - previous) * Pack(step.inverse_previous);
            a += wind_acceleration(wind, velocity, Pack(group.drag[i]), Pack(step.inverse_step));
        }
        move = verlet_move(x, previous, carry, a, Pack(step.half_square));
    }
    const Pack longest = longest_turn(b.length(i)) + Pack(step.thrown);
    const Pack3 beside = move - parent_move;
    if (any(longest * longest < dot(beside, beside)))
        move = resolved_move(move, parent_move, longest);
    parent_move = move;
    b.set_x_previous(i, x);
    const Pack3 moved = x + move;
    b.set_x(i, moved);
    return moved;
}

// Where a sweep begins: the root now, and its move since the small step began.
template <class Pack>
struct RootMove {
    RootNow<Pack> now;
    Vec3<Pack> move;
};
template <class Pack>
KERATIN_ALWAYS_INLINE RootMove<Pack> move_root(const Part<Pack>& b, const SmallStep& step) {
    const RootNow<Pack> root = root_now(b, step.fraction);
    b.set_x_previous(0, b.x(0));
    b.set_x_previous(1, b.x(1));
    b.set_x(0, root.x0);
    b.set_x(1, root.x1);
    b.set3(slot_x, 1, root.direction);
    return {root, root.x1 - b.x_previous(1)};
}

// Points without bending.
template <Air air, class Pack>
[[gnu::noinline]] void predict_loose(const Part<Pack> b, const QuadClass& group,
                                     const SmallStep& step, std::span<const WindWave> waves = {}) {
    const RootMove<Pack> root = move_root(b, step);
    Vec3<Pack> parent_move = root.move;
    for (std::size_t i = 2; i < b.rows; ++i)
        move_point<air, true>(b, group, step, waves, i, parent_move);
}

// Points to bend: gravity enters with the elastic forces, so that at rest both are taken at the
// same place. Directions of the moved edges and the inverse of their lengths go to where bend()
// overwrites them with its results: a loop of its own, so that roots and divisions of many rows
// overlap. Returns the root.
template <Air air, class Pack>
[[gnu::noinline]] RootNow<Pack> predict(const Part<Pack> b, const QuadClass& group,
                                        const SmallStep& step,
                                        std::span<const WindWave> waves = {}) {
    using Pack3 = Vec3<Pack>;
    const RootMove<Pack> root = move_root(b, step);
    Pack3 parent_move = root.move;
    Pack3 x = root.now.x1;
    for (std::size_t i = 2; i < b.rows; ++i) {
        const Pack3 child = move_point<air, false>(b, group, step, waves, i, parent_move);
        const Pack3 e = child - x;
        const Pack inverse = Pack(1.0f) / sqrt(max(dot(e, e), Pack(1e-24f)));
        b.set3(slot_x, i, e * inverse);
        b.set(slot_sweep1, i, inverse);
        x = child;
    }
    return root.now;
}

// The elastic moments at the predicted places, eliminated on the way.
template <class Pack>
[[gnu::noinline]] void bend(const Part<Pack> b, const QuadClass& group, const SmallStep& step,
                            const RootNow<Pack> root) {
    using Pack3 = Vec3<Pack>;
    const std::size_t n = b.rows - 1;
    const Pack zero(0.0f);
    const Pack3 none(zero, zero, zero);
    const Pack3 fall = splat<Pack>(step.gravity) * Pack(step.half_square);
    const Pack3 side = cross(root.direction, root.director);
    Pack3 t = root.direction;  // of the parent now
    Pack3 r = root.direction;  // of the parent in the unloaded shape, carried by the root
    Pack inverse_length = b.get(slot_inverse_length, 1);
    const Pack3 root_rate = root_turn(root_now(b, step.fraction_before), root);
    const Pack damping(group.bend_damping), held(group.held);
    Pack3 now = root.x1, before = b.x_previous(1);
    Pack3 rate = none;  // of the parent: how its edge moved in the root's frame
    Pack3 f1 = none;    // of the joint before: pulls its own point, pushes the child
    Pack3 load = none;  // gathered so far on the joint's own point
    Pack3 y1 = none, y2 = none;
    const auto finish_row = [&](std::size_t j, const Pack3& force) {
        const Pack3 y = force - y2 * b.get(slot_band2, j) - y1 * b.get(slot_band1, j);
        b.set3(slot_x, j, y);
        y2 = y1;
        y1 = y;
    };
    for (std::size_t i = 1; i < n; ++i) {
        const Pack3 u = b.get3(slot_x, i + 1);
        // The child's direction at its rest length: stretch is not this sweep's matter, and taken
        // as such it would be far stiffer than bending.
        // As weight counts by h (h + h-) / 2, so do the forces that carry it; the matrix stays the
        // step's own, which is stable while the share is less than twice its damping.
        const Pack stiffness = b.get(slot_stiffness, i), along = b.get(slot_along, i);
        const Pack k = stiffness * Pack(step.elastic_share);
        const Pack kl = k * b.length(i + 1);
        const Pack3 c = b.edge(i + 1);
        const Pack3 d = root.direction * c.x + root.director * c.y + side * c.z;
        const Pack turn = bend_inverse(r, t);
        const Pack3 g = bend_target(r, t, d, along, turn);
        const Pack lever = b.get(slot_lever, i);
        const Pack3 child = b.x(i + 1), child_before = b.x_previous(i + 1);
        const Pack3 e_before = child_before - before;
        const Pack3 rate_next = child - now - e_before - cross(root_rate, e_before);
        const Pack3 slowed = (rate_next - rate * lever) * (stiffness * damping);
        const Pack3 weight = (fall - u * (dot(u, fall) * held)) * b.get(slot_beyond, i + 1);
        const Pack inverse_rest = b.get(slot_inverse_length, i + 1);
        const Pack pull = bend_pull(b.length(i + 1), dot(u, g), held);
        const Pack3 f = u * (k * pull) - g * k + slowed - weight;
        const Pack3 reaction = bend_reaction(r, t, g, u, along, turn, kl * inverse_length) +
                               slowed * lever - rate * b.get(slot_drag, i);
        now = child;
        before = child_before;
        rate = rate_next;
        if (i >= 3) finish_row(i - 1, load - reaction);
        load = f - f1 + reaction;
        f1 = f;
        t = u;
        r = d * inverse_rest;
        // A predicted edge may have next to no length; what it feels stays bounded.
        inverse_length = min(b.get(slot_sweep1, i + 1), inverse_rest * Pack(16.0f));
    }
    if (n >= 3) finish_row(n - 1, load);
    finish_row(n, -f1);
}

}  // namespace keratin::KERATIN_ISA
