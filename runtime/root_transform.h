// Where a root is carried (METHODS 1.1): by bones or by a triangle of the deformed mesh, and then
// by the asset's own motion. One text for every solver that runs assets: the strand solver's pass
// `skin` takes it in float, the rods in double.
#pragma once

#include "runtime/settings.h"
#include "schema/fields.h"
#include "schema/formula/barycentric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

namespace keratin {

using Vec3d = Vec3<double>;
using Vec4d = Vec4<double>;
using Vec3f = Vec3<float>;
using Vec4f = Vec4<float>;

inline Vec3d translation_of(const RigidTransform& t) {
    return Vec3d(t.translation[0], t.translation[1], t.translation[2]);
}
inline Vec4d rotation_of(const RigidTransform& t) {
    return Vec4d(t.rotation[0], t.rotation[1], t.rotation[2], t.rotation[3]);
}
inline RigidTransform transform_of(const Vec4d& q, const Vec3d& t) {
    return {{t.x, t.y, t.z}, {q.x, q.y, q.z, q.w}};
}
// x -> a (b x)
inline RigidTransform chained(const RigidTransform& a, const RigidTransform& b) {
    return transform_of(product(rotation_of(a), rotation_of(b)),
                        rotate(rotation_of(a), translation_of(b)) + translation_of(a));
}

// Maps a point x of the groom to rotate(rotation, x) + translation.
template <class Real>
struct RootTransform {
    Vec4<Real> rotation;  // unit quaternion
    Vec3<Real> translation;
};

template <class Real>
bool finite(const RootTransform<Real>& r) {
    const Real sum = r.rotation.x + r.rotation.y + r.rotation.z + r.rotation.w + r.translation.x +
                     r.translation.y + r.translation.z;
    return std::isfinite(sum);
}

template <class Real>
Vec3<Real> rounded(const Vec3d& v) {
    return Vec3<Real>(Real(v.x), Real(v.y), Real(v.z));
}
template <class Real>
Vec3d exact(const Vec3<Real>& v) {
    return Vec3d(double(v.x), double(v.y), double(v.z));
}

// A transform, counted from `origin`.
template <class Real>
RootTransform<Real> relative(const RigidTransform& t, const std::array<double, 3>& origin) {
    const Vec3d p = translation_of(t) - Vec3d(origin[0], origin[1], origin[2]);
    const Vec4d q = rotation_of(t);
    return {Vec4<Real>(Real(q.x), Real(q.y), Real(q.z), Real(q.w)), rounded<Real>(p)};
}

// The blend of four bones: quaternions are summed, and the root itself goes where the bones' mean
// takes it.
//   bone_world  [bones]  rest to present, after the asset's motion
//   weight      sum 1
//   rest        m, the root in the groom
template <class Real>
RootTransform<Real> bone_root(std::span<const RigidTransform> bone_world,
                              const std::array<double, 3>& origin, const std::uint32_t bone[4],
                              const float weight[4], const Vec3<Real>& rest) {
    if (weight[0] >= 1.0f) return relative<Real>(bone_world[bone[0]], origin);
    Vec4<Real> sum(0, 0, 0, 0), first(0, 0, 0, 1);
    Vec3<Real> point(0, 0, 0);
    for (int k = 0; k < 4; ++k) {
        if (weight[k] <= 0) continue;
        const RootTransform<Real> r = relative<Real>(bone_world[bone[k]], origin);
        if (k == 0) first = r.rotation;
        // The same rotation has two quaternions: take the one on the first bone's side.
        const Real side = dot(first, r.rotation) < 0 ? -Real(weight[k]) : Real(weight[k]);
        sum = sum + r.rotation * side;
        point = point + (rotate(r.rotation, rest) + r.translation) * Real(weight[k]);
    }
    RootTransform<Real> root;
    root.rotation = unit_quaternion(sum);
    root.translation = point - rotate(root.rotation, rest);
    return root;
}

template <class Real, class Stored>
Vec3<Real> mesh_vertex(std::span<const Stored> positions, std::uint32_t v) {
    return Vec3<Real>(Real(positions[v * 3]), Real(positions[v * 3 + 1]),
                      Real(positions[v * 3 + 2]));
}

// The turn of a triangle's tangent frame from rest to now, after it the asset's motion. The
// translation is what takes the root itself, which stands at `rest` in the groom, to its place as
// numbers of this kind hold it: a turn about the far origin of the groom rounds by more than a
// face's triangles can bear.
//   corner  stored vertices of the triangle
//   mesh    [stored vertices * 3] m, at rest;  now  the same in the present
template <class Real>
RootTransform<Real> triangle_root(const std::uint32_t* corner, std::span<const float> mesh,
                                  std::span<const Real> now, float u, float v,
                                  const RigidTransform& body, const std::array<double, 3>& origin,
                                  const Vec3<Real>& rest) {
    const Vec3<Real> ra = mesh_vertex<Real>(mesh, corner[0]),
                     rb = mesh_vertex<Real>(mesh, corner[1]),
                     rc = mesh_vertex<Real>(mesh, corner[2]);
    const Vec3<Real> na = mesh_vertex<Real>(now, corner[0]), nb = mesh_vertex<Real>(now, corner[1]),
                     nc = mesh_vertex<Real>(now, corner[2]);
    const Vec4<Real> turn =
        product(triangle_rotation(na, nb, nc), conjugate(triangle_rotation(ra, rb, rc)));
    const Vec3d from = barycentric_point(exact(ra), exact(rb), exact(rc), double(u), double(v)),
                to = barycentric_point(exact(na), exact(nb), exact(nc), double(u), double(v));
    const Vec3d beside = exact(rotate(turn, rounded<Real>(exact(rest) - from)));
    const Vec3d place = rotate(rotation_of(body), to + beside) + translation_of(body) -
                        Vec3d(origin[0], origin[1], origin[2]);
    RootTransform<Real> root;
    root.rotation = unit_quaternion(product(relative<Real>(body, origin).rotation, turn));
    root.translation = rounded<Real>(place - exact(rotate(root.rotation, rest)));
    return root;
}

// Stored triangle of a triangle of the source mesh; the number of stored triangles or another's
// where it is not stored.
inline std::uint32_t stored_triangle(const AssetFields& fields, std::uint32_t source) {
    if (fields.mesh_triangle_source.empty()) return source;
    const auto at = std::ranges::lower_bound(fields.mesh_triangle_source, source);
    return std::uint32_t(at - fields.mesh_triangle_source.begin());
}

}  // namespace keratin
