// The sweep from root to tip that ends a small step: points move as the tension asks (yield.h) and
// by the pull of the global length (METHODS 1.4); then every segment gets its exact length, and
// points inside of colliders are moved out, with Coulomb friction against the surface's own motion,
// and put back at their distance from the parent in turn.
#pragma once

#include "runtime/formula/contact.h"
#include "runtime/formula/length.h"
#include "runtime/pass/solid.h"

namespace keratin::KERATIN_ISA {

// Rounds of push out and put back at most. Each is a step of Newton's method on the angle, so one
// or two do for hair on a head; more are for points that meet two colliders or an edge.
inline constexpr int kRounds = 16;
// m, depth that ends the rounds: a tenth of the thinnest hair's radius.
inline constexpr float kDeepEnough = 2e-6f;
// m, of a point towards the surface in a small step: half a metre a second at 60 frames.
inline constexpr float kMostRise = 2e-3f;

// The colliders that reach a block.
struct Near {
    const ColliderShapeData* shapes;
    const ColliderPose* poses;
    const std::uint32_t* index;
    std::uint32_t count;

    const ColliderShapeData& shape(std::uint32_t k) const { return shapes[index[k]]; }
    const ColliderPose& pose(std::uint32_t k) const { return poses[index[k]]; }
};

// How deep a place of a row lies in what it lies deepest in, and the way out of that; `way` stays
// as it is where there is nothing near.
template <class Pack>
[[gnu::noinline]] Pack deepest_in(const Part<Pack> b, const Near& near, std::size_t row,
                                  const Vec3<Pack>& at, Vec3<Pack>& way) {
    Pack deepest(-1e9f);
    for (std::uint32_t k = 0; k < near.count; ++k) {
        const ColliderPose& pose = near.pose(k);
        Vec3<Pack> normal;
        const Pack distance =
            own_distance(near.shape(k), times(pose.to_own, at - splat<Pack>(pose.place)), normal);
        const Pack depth = kept_distance(near.shape(k), b, row) - distance;
        way = select(deepest < depth, transposed_times(pose.to_own, normal), way);
        deepest = max(deepest, depth);
    }
    return deepest;
}

// The last resort for points in folds, where the way out of one side leads into the other: their
// segments lean over towards the surface's normal at the parent until they are free.
template <class Pack, class Mask>
[[gnu::noinline]] void lift_out(const Part<Pack> b, const Near& near, std::size_t i,
                                const Vec3<Pack>& parent, const Pack& l, Mask deep, Vec3<Pack>& x,
                                Vec3<Pack>& t) {
    Vec3<Pack> up = t, ignored = t;
    deepest_in(b, near, i - 1, parent, up);
    for (const float lean : {0.25f, 0.5f, 0.75f, 1.0f}) {
        const Vec3<Pack> way = normalize_or(t * Pack(1 - lean) + up * Pack(lean), up);
        const Vec3<Pack> at = parent + way * l;
        const Pack depth = deepest_in(b, near, i, at, ignored);
        const auto free = deep & (depth < Pack(kDeepEnough));
        x = select(free, at, x);
        t = select(free, way, t);
        deep = deep & (Pack(kDeepEnough) < depth);
        if (!any(deep)) return;
    }
}

enum class Lengths { loose, exact };

// Contact of the points of a row: x is moved out, t its direction from the parent; exact lengths
// stay so. Only lanes that are inside change, or results would depend on who their neighbours in
// the pack are. Returns the part of the move that is no matter of length.
template <class Pack>
[[gnu::noinline]] Vec3<Pack> move_out(Lengths lengths, const Part<Pack> b, const Near& near,
                                      std::size_t i, const Vec3<Pack>& parent, const Pack& l,
                                      Vec3<Pack>& x, Vec3<Pack>& t) {
    using Pack3 = Vec3<Pack>;
    const bool exact = lengths == Lengths::exact;
    const Pack zero(0.0f), one(1.0f);
    Pack3 out = x;
    Pack hits = zero, hit_by = zero;
    KeptDistances<Pack> kept(b, i);
    // Lanes whose way out is not known to end outside of what they hit; in a concave shape only a
    // short way is.
    auto unsure = zero < zero, concave = unsure;
    // A point that began the small step inside rises by no more than kMostRise towards the surface,
    // and what it rises is no velocity: nothing is thrown out. Above 0 where that leaves it inside.
    Pack patient = zero;
    Pack3 previous = b.x_previous(i);
    for (std::uint32_t k = 0; k < near.count; ++k) {
        const ColliderShapeData& shape = near.shape(k);
        const ColliderPose& pose = near.pose(k);
        Pack3 normal;
        const Pack depth = depth_in(shape, pose, k, kept, out, normal);
        const auto inside = zero < depth;
        if (!any(inside)) continue;
        const auto before = [&](const Pack3& place) {
            return times(pose.from_now, place) + splat<Pack>(pose.from_place);
        };
        Pack push = select(inside, depth, zero);
        Pack rise = max(zero, min(push, dot(before(out + normal * push) - previous, normal)));
        Pack left = max(zero, rise - Pack(kMostRise));
        if (any(zero < left)) {
            const Pack3 carried =
                transposed_times(pose.from_now, previous - splat<Pack>(pose.from_place));
            Pack3 ignored;
            const Pack began = depth_in(shape, pose, k, kept, carried, ignored);
            left = select(Pack(kMostRise) < began, left, zero);
        }
        push = push - left;
        rise = rise - left;
        patient = patient + left;
        const Pack3 at = out + (exact ? way_out(t, l, normal, push) : normal * push);
        const Pack3 slide = before(at) - previous;
        const Pack3 held = friction_move(slide, normal, push, Pack(shape.friction));
        Pack3 moved = at + held;
        if (exact) {
            // In the tangent plane of a convex shape a point is outside.
            const auto in_plane = zero < plane_room(t, l, normal, push);
            const Pack3 way = (at - parent) * (one / max(l, Pack(1e-9f)));
            moved = select(in_plane, parent + turned_along(way, l, normal, held) * l, moved);
            unsure = unsure | (zero < select(in_plane, zero, push));
            if (shape.kind == ShapeKind::grid) concave = concave | inside;
        }
        out = select(inside, moved, out);
        previous = select(inside, previous + normal * rise, previous);
        hits = select(inside, hits + one, hits);
        hit_by = select(inside, Pack(float(k)), hit_by);
    }
    const Pack3 shift = out - x;
    b.set_x_previous(i, previous);
    if (!exact) {
        x = out;
        return shift;
    }
    const auto put_back = [&](const auto& lanes) {
        t = select(lanes, normalize_or(out - parent, t), t);
        x = select(lanes, parent + t * l, x);
    };
    auto deep = zero < hits;
    put_back(deep);
    // A way w along the sphere about the parent ends about w^2 / 2l off the tangent plane.
    const auto far = l * Pack(kDeepEnough) < dot(shift, shift);
    unsure = unsure | (one < hits) | (concave & far);
    for (std::uint32_t k = 0; k < near.count && near.count > 1; ++k) {
        const Pack other = abs(hit_by - Pack(float(k)));
        unsure = unsure | ((zero < other) & reached_in(near.shape(k), near.pose(k), x));
    }
    deep = deep & unsure & (patient < Pack(kDeepEnough));
    for (int round = 0; round < kRounds && any(deep); ++round) {
        out = x;
        Pack hit = zero;
        for (std::uint32_t k = 0; k < near.count; ++k) {
            Pack3 normal;
            const Pack depth = depth_in(near.shape(k), near.pose(k), k, kept, out, normal);
            const auto inside = deep & (Pack(kDeepEnough) < depth);
            if (!any(inside)) continue;
            out = select(inside, out + way_out(t, l, normal, depth), out);
            hit = select(inside, one, hit);
        }
        deep = zero < hit;
        put_back(deep);
    }
    if (any(deep)) lift_out(b, near, i, parent, l, deep, x, t);
    return shift;
}

template <bool tension, bool exact, bool collide, class Pack>
[[gnu::noinline]] void settle(const Part<Pack> b, const QuadClass& group, const Near& near) {
    using Pack3 = Vec3<Pack>;
    const std::size_t n = b.rows - 1;
    const Pack zero(0.0f);
    const Pack3 none(zero, zero, zero);
    const Pack pull(group.pull), damping(group.length_damping);
    const bool pulls = group.pull > 0;

    Pack3 parent = b.x(1);
    Pack3 pulled = parent;  // where the parent was before its exact length and collisions
    Pack3 t = b.get3(slot_x, 1);
    for (std::size_t i = 2; i <= n; ++i) {
        Pack3 x = b.x(i);
        const Pack l = b.length(i);
        if constexpr (tension) x = x + b.get3(slot_x, i);
        Pack3 before = x;
        if constexpr (exact) {
            if (pulls) {
                x = x + pull_to_parent(x - pulled, l) * pull;
                pulled = x;
            }
            t = normalize_or(x - parent, t);
            x = parent + t * l;
        } else {
            x = select(l < Pack(1e-9f), parent, x);
        }
        if constexpr (collide) {
            for (std::uint32_t k = 0; k < near.count; ++k) {
                if (near.shape(k).kind != ShapeKind::grid) continue;
                Pack3 end = x;
                Pack stopped;
                if (!stop_at_grid(near.shape(k), near.pose(k), b, i, end, stopped)) continue;
                before = before + (end - x);
                x = end;
                if constexpr (exact) {
                    t = select(zero < stopped, normalize_or(x - parent, t), t);
                    x = select(zero < stopped, parent + t * l, x);
                }
            }
            for (std::uint32_t k = 0; k < near.count; ++k) {
                if (!reaches(near.shape(k), near.pose(k), x)) continue;
                Pack3 end = x, way = t;
                before = before + move_out(exact ? Lengths::exact : Lengths::loose, b, near, i,
                                           parent, l, end, way);
                x = end;
                t = way;
                break;
            }
        }
        b.set_x(i, x);
        // The velocity that following the parent adds is taken back from the parent (dynamic
        // follow-the-leader).
        if constexpr (exact)
            if (i > 2) b.set_x_previous(i - 1, b.x_previous(i - 1) + (x - before) * damping);
        parent = x;
    }
}

}  // namespace keratin::KERATIN_ISA
