// Unit quaternions (x, y, z, w) as rotations v -> q v q*. The conventions of the whole project:
// right-handed, w last, product(a, b) turns by b first.
#ifndef KERATIN_SCHEMA_FORMULA_QUATERNION_H
#define KERATIN_SCHEMA_FORMULA_QUATERNION_H

#include "schema/formula/vec3.h"
#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// Rotation by b, then by a.
KERATIN_FORMULA Real4 product(Real4 a, Real4 b) {
    return Real4(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                 a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                 a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                 a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
}

// The inverse of a unit quaternion.
KERATIN_FORMULA Real4 conjugate(Real4 q) { return Real4(-q.x, -q.y, -q.z, q.w); }

// q v q*, as v + 2w (u x v) + 2 u x (u x v).
KERATIN_FORMULA Real3 rotate(Real4 q, Real3 v) {
    Real3 u = Real3(q.x, q.y, q.z);
    Real3 t = cross(u, v) * Real(2);
    return v + t * q.w + cross(u, t);
}

// q / |q|; the identity where q is shorter than 1e-18.
KERATIN_FORMULA Real4 unit_quaternion(Real4 q) {
    Real square = dot(q, q);
    Bool tiny = square < Real(1e-36);
    Real inverse = Real(1) / sqrt(select(tiny, Real(1), square));
    return select(tiny, Real4(Real(0), Real(0), Real(0), Real(1)), q * inverse);
}

// Turns from a to b along the shorter way, normalised linearly: s = 0 gives a, 1 gives b.
KERATIN_FORMULA Real4 nlerp(Real4 a, Real4 b, Real s) {
    Real sign = select(dot(a, b) < Real(0), Real(-1), Real(1));
    return unit_quaternion(a * (Real(1) - s) + b * (sign * s));
}

// The rotation whose matrix has the orthonormal columns c0, c1, c2 (Shepperd 1978, the largest of
// the four candidates).
KERATIN_FORMULA Real4 quaternion_of_columns(Real3 c0, Real3 c1, Real3 c2) {
    Real4 w = Real4(c1.z - c2.y, c2.x - c0.z, c0.y - c1.x, Real(1) + c0.x + c1.y + c2.z);
    Real4 x = Real4(Real(1) + c0.x - c1.y - c2.z, c1.x + c0.y, c2.x + c0.z, c1.z - c2.y);
    Real4 y = Real4(c1.x + c0.y, Real(1) - c0.x + c1.y - c2.z, c2.y + c1.z, c2.x - c0.z);
    Real4 z = Real4(c2.x + c0.z, c2.y + c1.z, Real(1) - c0.x - c1.y + c2.z, c0.y - c1.x);
    Real4 xy = select(x.x < y.y, y, x);
    Real best_xy = max(x.x, y.y);
    Real4 zw = select(z.z < w.w, w, z);
    Real best_zw = max(z.z, w.w);
    return unit_quaternion(select(best_xy < best_zw, zw, xy));
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
