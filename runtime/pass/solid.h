// Distance of a block of points to a collider, whatever its shape.
#pragma once

#include "runtime/pass/distance_nodes.h"
#include "runtime/pass/work.h"
#include "runtime/shape/distance.h"

#include <algorithm>
#include <cmath>

namespace keratin::KERATIN_ISA {

// Calls body.operator()<kind>() for the collider's shape.
template <class Body>
KERATIN_ALWAYS_INLINE void with_shape(ShapeKind kind, Body&& body) {
    switch (kind) {
        case ShapeKind::capsule:
            body.template operator()<ShapeKind::capsule>();
            break;
        case ShapeKind::box:
            body.template operator()<ShapeKind::box>();
            break;
        case ShapeKind::plane:
            body.template operator()<ShapeKind::plane>();
            break;
        case ShapeKind::grid:
            body.template operator()<ShapeKind::grid>();
            break;
    }
}

// Distance in the shape's own space. Out of line, as all that only points near a collider need:
// sweeps hold their loops alone.
template <class Pack>
[[gnu::noinline]] Pack own_distance(const ColliderShapeData& s, const Vec3<Pack>& p,
                                    Vec3<Pack>& normal) {
    Pack distance;
    with_shape(s.kind, [&]<ShapeKind kind>() {
        if constexpr (kind == ShapeKind::capsule)
            distance = capsule_distance(p, splat<Pack>(s.a), splat<Pack>(s.b),
                                        Pack(s.inverse_square), Pack(s.radius), normal);
        else if constexpr (kind == ShapeKind::box)
            distance = box_distance(p - splat<Pack>(s.a), splat<Pack>(s.b), normal);
        else if constexpr (kind == ShapeKind::plane)
            distance = plane_distance(p, splat<Pack>(s.a), splat<Pack>(s.b), normal);
        else
            distance = grid_distance(s.grid, p, normal);
    });
    return distance;
}
// The same where nobody asks for the way out.
template <class Pack>
KERATIN_ALWAYS_INLINE Pack own_distance(const ColliderShapeData& s, const Vec3<Pack>& p) {
    if (s.kind == ShapeKind::grid) return grid_distance(s.grid, p);
    Vec3<Pack> ignored;
    return own_distance(s, p, ignored);
}

// Distance that a point keeps: the contact distance, or less where the groom at rest lies deeper.
template <class Pack>
KERATIN_ALWAYS_INLINE Pack kept_distance(const ColliderShapeData& s, const Part<Pack>& b,
                                         std::size_t row) {
    const Pack kept(s.distance);
    if (!s.allows_rest_depth) return kept;
    const Vec3<Pack> rest = times(s.rest_to_own, b.rest(row) - splat<Pack>(s.rest_place));
    return min(kept, own_distance(s, rest));
}

// That of a row from each of its colliders, worked out once at most.
template <class Pack>
struct KeptDistances {
    static constexpr std::uint32_t kRemembered = 4;
    const Part<Pack>& part;
    std::size_t row;
    std::uint32_t known = 0;
    Pack value[kRemembered];

    KERATIN_ALWAYS_INLINE KeptDistances(const Part<Pack>& b, std::size_t i) : part(b), row(i) {}
    KERATIN_ALWAYS_INLINE Pack of(std::uint32_t k, const ColliderShapeData& s) {
        if (!s.allows_rest_depth) return Pack(s.distance);
        if (k >= kRemembered) return kept_distance(s, part, row);
        if (!(known >> k & 1)) value[k] = kept_distance(s, part, row);
        known |= 1u << k;
        return value[k];
    }
};

// Points of x that can lie in a capsule: exact but for rounding, without their root.
template <class Pack>
KERATIN_ALWAYS_INLINE auto reached_in_capsule(const ColliderShapeData& s, const ColliderPose& pose,
                                              const Vec3<Pack>& x) {
    const float reach = (s.radius + s.distance) * 1.00001f;
    return capsule_square(x, splat<Pack>(pose.core), splat<Pack>(pose.core_way),
                          Pack(s.inverse_square)) < Pack(reach * reach);
}
// In any shape.
template <class Pack>
[[gnu::noinline]] auto reached_in(const ColliderShapeData& s, const ColliderPose& pose,
                                  const Vec3<Pack>& x) {
    if (s.kind == ShapeKind::capsule) return reached_in_capsule(s, pose, x);
    return own_distance(s, times(pose.to_own, x - splat<Pack>(pose.place))) < Pack(s.distance);
}

// Whether any of them does.
template <class Pack>
KERATIN_ALWAYS_INLINE bool reaches(const ColliderShapeData& s, const ColliderPose& pose,
                                   const Vec3<Pack>& x) {
    const Vec3<Pack> from = x - splat<Pack>(pose.middle);
    if (!any(dot(from, from) < Pack(pose.reach_square))) return false;
    if (s.kind == ShapeKind::capsule) return any(reached_in_capsule(s, pose, x));
    const Vec3<Pack> copy = x;  // x itself stays in its registers
    return any(reached_in(s, pose, copy));
}

// How deep x lies in the k-th collider of a row, and the way out in the world.
template <class Pack>
[[gnu::noinline]] Pack depth_in(const ColliderShapeData& s, const ColliderPose& pose,
                                std::uint32_t k, KeptDistances<Pack>& kept, const Vec3<Pack>& x,
                                Vec3<Pack>& normal) {
    const bool capsule = s.kind == ShapeKind::capsule;
    const Pack distance =
        capsule ? capsule_distance(x, splat<Pack>(pose.core), splat<Pack>(pose.core_way),
                                   Pack(s.inverse_square), Pack(s.radius), normal)
                : own_distance(s, times(pose.to_own, x - splat<Pack>(pose.place)), normal);
    const Pack depth = Pack(s.distance) - distance;
    if (!any(Pack(0.0f) < depth)) return depth;
    if (!capsule) normal = transposed_times(pose.to_own, normal);
    return kept.of(k, s) - distance;
}

// Where points that moved by more than half a cell of a distance grid since the small step's start
// end if they meet its surface on the way: past the first contact they go on along the surface.
// From the far side of a sheet the gradient leads out on the far side, and a point beyond it is not
// inside at all. Returns whether any point was stopped; `stopped` is 1 for those and 0 for others,
// which stay as they are.
template <class Pack>
[[gnu::noinline]] bool stop_at_grid(const ColliderShapeData& s, const ColliderPose& pose,
                                    const Part<Pack> b, std::size_t row, Vec3<Pack>& x,
                                    Pack& stopped) {
    // The start, carried with the surface to now.
    const Vec3<Pack> from =
        transposed_times(pose.from_now, b.x_previous(row) - splat<Pack>(pose.from_place));
    const Vec3<Pack> way = x - from;
    const Pack square = dot(way, way);
    const float unnoticed = 0.5f * s.grid.spacing, resting = 0.1f * s.grid.spacing;
    if (!any(Pack(unnoticed * unnoticed) < square)) return false;
    constexpr int kLanes = Pack::kLanes;
    constexpr float kMostSamples = 64;
    float start[3][kLanes], end[3][kLanes], far[kLanes], kept[kLanes], hit[kLanes] = {};
    const auto spread = [](const Vec3<Pack>& v, float(&out)[3][kLanes]) {
        store(v.x, out[0], 16);
        store(v.y, out[1], 16);
        store(v.z, out[2], 16);
    };
    spread(times(pose.to_own, from - splat<Pack>(pose.place)), start);
    spread(times(pose.to_own, x - splat<Pack>(pose.place)), end);
    store(sqrt(square), far, 16);
    store(kept_distance(s, b, row), kept, 16);
    for (int l = 0; l < kLanes; ++l) {
        if (!(far[l] > unnoticed)) continue;
        const float samples =
            std::min(std::ceil(2 * far[l] * s.grid.inverse_spacing), kMostSamples);
        const auto depth_at = [&](float share, float q[3], float normal[3]) {
            for (int c = 0; c < 3; ++c) q[c] = start[c][l] + (end[c][l] - start[c][l]) * share;
            return kept[l] - node_distance(s.grid, q, normal);
        };
        float q[3], normal[3], outside = 0;
        // Where rounding leaves points that lie on the surface it holds them; what starts deeper is
        // left to the push out.
        float lift = depth_at(0, q, normal);
        if (lift > resting) continue;
        bool meets = lift > 0;
        for (float k = 1; k <= samples && !meets; k += 1) {
            float inside = k / samples;
            meets = depth_at(inside, q, normal) > 0;
            if (!meets) {
                outside = inside;
                continue;
            }
            // The normal belongs to where the point came in: it may be past the middle by now.
            for (int halving = 0; halving < 4; ++halving) {
                const float middle = 0.5f * (outside + inside);
                (depth_at(middle, q, normal) > 0 ? inside : outside) = middle;
            }
            lift = depth_at(inside, q, normal);
        }
        if (!meets) continue;
        float deeper = -lift;
        for (int c = 0; c < 3; ++c) deeper += (end[c][l] - q[c]) * normal[c];
        if (deeper >= 0) continue;
        for (int c = 0; c < 3; ++c) end[c][l] -= deeper * normal[c];
        hit[l] = 1;
    }
    stopped = load<Pack>(hit, 16);
    const auto hits = Pack(0.0f) < stopped;
    if (!any(hits)) return false;
    const Vec3<Pack> own(load<Pack>(end[0], 16), load<Pack>(end[1], 16), load<Pack>(end[2], 16));
    x = select(hits, transposed_times(pose.to_own, own) + splat<Pack>(pose.place), x);
    return true;
}

// Whether the collider can reach a box.
KERATIN_ALWAYS_INLINE bool overlaps(const float (&low)[3], const float (&high)[3],
                                    const ColliderPose& pose, float margin) {
    for (int c = 0; c < 3; ++c) {
        if (high[c] + margin < pose.bounds_min[c]) return false;
        if (pose.bounds_max[c] < low[c] - margin) return false;
    }
    return true;
}

}  // namespace keratin::KERATIN_ISA
