// Colliders: their shapes once, their poses for every small step.
#include "runtime/state.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace keratin {

namespace {

float largest_radius(const AssetInfo& info) {
    float r = 0;
    for (const GroupInfo& g : info.groups) r = std::max({r, g.material.radius, g.material.radius2});
    return r;
}

void set3(float (&out)[3], const std::array<float, 3>& v) { std::copy(v.begin(), v.end(), out); }

ColliderShapeData capsule(const std::array<float, 3>& a, const std::array<float, 3>& b,
                          float radius) {
    ColliderShapeData s;
    s.kind = ShapeKind::capsule;
    set3(s.a, a);
    float square = 0;
    for (int c = 0; c < 3; ++c) {
        s.b[c] = b[c] - a[c];
        square += s.b[c] * s.b[c];
    }
    s.inverse_square = square > 1e-18f ? 1 / square : 0;
    s.radius = radius;
    return s;
}

ColliderShapeData shape_of(const Collider& c) {
    ColliderShapeData s;
    if (const auto* sphere = std::get_if<SphereCollider>(&c.shape))
        s = capsule(sphere->center, sphere->center, sphere->radius);
    else if (const auto* cap = std::get_if<CapsuleCollider>(&c.shape))
        s = capsule(cap->a, cap->b, cap->radius);
    else if (const auto* box = std::get_if<BoxCollider>(&c.shape)) {
        s.kind = ShapeKind::box;
        set3(s.a, box->center);
        set3(s.b, box->half_size);
    } else if (const auto* plane = std::get_if<PlaneCollider>(&c.shape)) {
        s.kind = ShapeKind::plane;
        set3(s.a, plane->point);
        set3(s.b, plane->normal);
    } else {
        const DistanceGrid& g = *std::get<DistanceGridCollider>(c.shape).grid;
        s.kind = ShapeKind::grid;
        s.grid.distance = g.distance.data();
        std::copy(g.origin.begin(), g.origin.end(), s.grid.origin);
        std::copy(g.nodes.begin(), g.nodes.end(), s.grid.nodes);
        s.grid.spacing = g.spacing;
        s.grid.inverse_spacing = 1 / g.spacing;
    }
    return s;
}

// The asset's own grid, read where it is mapped.
ColliderShapeData stored_grid(const DistanceGridInfo& grid, const AssetFields& fields) {
    ColliderShapeData s;
    s.kind = ShapeKind::grid;
    s.grid.distance = fields.grid_distance.data();
    s.grid.brick = fields.grid_brick.data();
    set3(s.grid.origin, grid.origin);
    for (int c = 0; c < 3; ++c) s.grid.nodes[c] = grid.bricks[c] * kBrickCells + 1;
    s.grid.spacing = grid.spacing;
    s.grid.inverse_spacing = 1 / grid.spacing;
    return s;
}

// Box around the shape in its own space, without the contact distance.
void own_bounds(const ColliderShapeData& s, float low[3], float high[3]) {
    for (int c = 0; c < 3; ++c) {
        switch (s.kind) {
            case ShapeKind::capsule:
                low[c] = std::min(s.a[c], s.a[c] + s.b[c]) - s.radius;
                high[c] = std::max(s.a[c], s.a[c] + s.b[c]) + s.radius;
                break;
            case ShapeKind::box:
                low[c] = s.a[c] - s.b[c];
                high[c] = s.a[c] + s.b[c];
                break;
            case ShapeKind::plane:
                low[c] = -std::numeric_limits<float>::infinity();
                high[c] = std::numeric_limits<float>::infinity();
                break;
            case ShapeKind::grid:
                low[c] = s.grid.origin[c];
                high[c] = s.grid.origin[c] + s.grid.spacing * float(s.grid.nodes[c] - 1);
                break;
        }
    }
}

// Half of the smallest extent.
float thickness(const ColliderShapeData& s) {
    switch (s.kind) {
        case ShapeKind::capsule:
            return s.radius;
        case ShapeKind::box:
            return std::min({s.b[0], s.b[1], s.b[2]});
        case ShapeKind::plane:
            return std::numeric_limits<float>::infinity();
        case ShapeKind::grid:
            return 0.25f * s.grid.spacing *
                   float(std::min({s.grid.nodes[0], s.grid.nodes[1], s.grid.nodes[2]}));
    }
    return 0;
}

void matrix_of(const Vec4d& q, double m[9]) {
    const Vec3d c0 = rotate(q, Vec3d(1, 0, 0)), c1 = rotate(q, Vec3d(0, 1, 0)),
                c2 = rotate(q, Vec3d(0, 0, 1));
    const double v[9] = {c0.x, c1.x, c2.x, c0.y, c1.y, c2.y, c0.z, c1.z, c2.z};
    std::copy(v, v + 9, m);
}

RigidTransform between(const RigidTransform& a, const RigidTransform& b, double s) {
    if (a == b) return a;
    const Vec3d ta = translation_of(a), tb = translation_of(b);
    return transform_of(nlerp(rotation_of(a), rotation_of(b), s), ta + (tb - ta) * s);
}

void pose(const ColliderShapeData& shape, const RigidTransform& before, const RigidTransform& now,
          const std::array<double, 3>& origin, ColliderPose& out) {
    const Vec4d q = rotation_of(now), q_before = rotation_of(before);
    const Vec3d place = translation_of(now) - Vec3d(origin[0], origin[1], origin[2]);
    const Vec3d place_before = translation_of(before) - Vec3d(origin[0], origin[1], origin[2]);
    double m[9], turn[9];
    matrix_of(q, m);
    // own = R^T (x - place): rows of R^T are columns of R.
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out.to_own[r * 3 + c] = float(m[c * 3 + r]);
    out.place[0] = float(place.x), out.place[1] = float(place.y), out.place[2] = float(place.z);
    const Vec4d back = product(q_before, conjugate(q));
    matrix_of(back, turn);
    for (int i = 0; i < 9; ++i) out.from_now[i] = float(turn[i]);
    const Vec3d shift = place_before - rotate(back, place);
    out.from_place[0] = float(shift.x), out.from_place[1] = float(shift.y);
    out.from_place[2] = float(shift.z);

    for (int r = 0; r < 3; ++r) {
        double start = (r == 0 ? place.x : r == 1 ? place.y : place.z), way = 0;
        for (int c = 0; c < 3; ++c) {
            start += m[r * 3 + c] * double(shape.a[c]);
            way += m[r * 3 + c] * double(shape.b[c]);
        }
        out.core[r] = float(start);
        out.core_way[r] = float(way);
    }

    float low[3] = {}, high[3] = {};
    own_bounds(shape, low, high);
    for (int c = 0; c < 3; ++c) {
        if (shape.kind == ShapeKind::plane) {
            out.bounds_min[c] = -std::numeric_limits<float>::infinity();
            out.bounds_max[c] = std::numeric_limits<float>::infinity();
            out.middle[c] = 0;
            out.reach_square = std::numeric_limits<float>::infinity();
            continue;
        }
        double mid = out.place[c], half = 0;
        for (int k = 0; k < 3; ++k) {
            mid += m[c * 3 + k] * 0.5 * (double(low[k]) + high[k]);
            half += std::fabs(m[c * 3 + k]) * 0.5 * (double(high[k]) - low[k]);
        }
        out.bounds_min[c] = float(mid - half) - shape.distance - 1e-5f;
        out.bounds_max[c] = float(mid + half) + shape.distance + 1e-5f;
    }
    if (shape.kind == ShapeKind::plane) return;
    double square = 0;  // of half the box's diagonal in its own space, of half a capsule's core
    for (int c = 0; c < 3; ++c) {
        const bool core = shape.kind == ShapeKind::capsule;
        const double half = core ? 0.5 * double(shape.b[c]) : 0.5 * (double(high[c]) - low[c]);
        square += half * half;
        out.middle[c] = 0.5f * (out.bounds_min[c] + out.bounds_max[c]);
    }
    const double reach = std::sqrt(square) + double(shape.distance) + 2e-5 +
                         (shape.kind == ShapeKind::capsule ? double(shape.radius) : 0.0);
    out.reach_square = float(reach * reach * 1.00001);
}

}  // namespace

void make_solids(Simulation::State& s) {
    const float radius = largest_radius(s.info);
    std::size_t i = 0;
    for (const Collider& c : s.settings.colliders) {
        ColliderShapeData& out = s.solids[i++];
        out = shape_of(c);
        out.friction = c.friction;
        out.distance = c.contact_distance > 0 ? c.contact_distance : radius;
    }
    if (!s.settings.asset_colliders) return;
    const auto carried = [&](ColliderShapeData& out) {
        out.friction = s.settings.asset_collider_friction;
        out.distance =
            s.settings.asset_collider_distance > 0 ? s.settings.asset_collider_distance : radius;
        out.allows_rest_depth = 1;
        out.rest_to_own[0] = out.rest_to_own[4] = out.rest_to_own[8] = 1;
    };
    if (const DistanceGridInfo& grid = s.info.distance_grid; grid.stored_bricks > 0) {
        s.solids[i] = stored_grid(grid, s.fields);
        carried(s.solids[i]);
        return;
    }
    for (const AssetCollider& c : s.info.colliders) {
        s.solids[i] = capsule(c.a, c.b, c.radius);
        carried(s.solids[i++]);
    }
}

double sweep(const Simulation::State& s, std::size_t i, float low[3], float high[3]) {
    ColliderPose start, end;
    pose(s.solids[i], s.collider_now[i], s.collider_now[i], s.settings.origin, start);
    pose(s.solids[i], s.collider_next[i], s.collider_next[i], s.settings.origin, end);
    double way = 0;
    for (int c = 0; c < 3; ++c) {
        way = std::max({way, std::fabs(double(end.bounds_min[c]) - start.bounds_min[c]),
                        std::fabs(double(end.bounds_max[c]) - start.bounds_max[c])});
        low[c] = std::min(start.bounds_min[c], end.bounds_min[c]);
        high[c] = std::max(start.bounds_max[c], end.bounds_max[c]);
    }
    return way;
}

SolidSteps steps_for_solids(const Simulation::State& s) {
    // A step of 64 parts takes a collider of 1 cm through 0.48 m: 29 m/s at 60 Hz.
    constexpr double kMost = 64;
    // Of the half thickness in a part: what was outside stays clear of the middle, where the way out
    // is anyone's guess.
    constexpr double kShare = 0.75;
    float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f};
    for (const QuadState& q : s.quads.span())
        for (int c = 0; c < 3 && q.guides > 0; ++c) {
            low[c] = std::min(low[c], q.bounds_min[c]);
            high[c] = std::max(high[c], q.bounds_max[c]);
        }
    double parts = 1, longest = 0;
    for (std::size_t i = 0; i < s.solids.size(); ++i) {
        if (s.collider_now[i] == s.collider_next[i]) continue;
        float swept_low[3], swept_high[3];
        const double way = sweep(s, i, swept_low, swept_high);
        bool meets = true;
        for (int c = 0; c < 3; ++c) meets &= swept_low[c] <= high[c] && swept_high[c] >= low[c];
        if (!meets || !std::isfinite(way)) continue;
        parts = std::max(parts, way / (kShare * double(thickness(s.solids[i]))));
        longest = std::max(longest, way);
    }
    return {std::uint32_t(std::ceil(std::min(parts, kMost))), longest};
}

void pose_solids(Simulation::State& s, std::uint32_t first, std::uint32_t count,
                 std::uint32_t steps) {
    for (std::size_t i = 0; i < s.solids.size(); ++i)
        for (std::uint32_t k = 0; k < count; ++k) {
            const double a = double(first + k) / steps, b = double(first + k + 1) / steps;
            pose(s.solids[i], between(s.collider_now[i], s.collider_next[i], a),
                 between(s.collider_now[i], s.collider_next[i], b), s.settings.origin,
                 s.poses[k * s.solids.size() + i]);
        }
}

}  // namespace keratin
