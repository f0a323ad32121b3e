// A root on a triangle (a, b, c): p = (1 - u - v) a + u b + v c, and the triangle's tangent frame.
// The root turns with the frame: rest frame to present frame.
#ifndef KERATIN_SCHEMA_FORMULA_BARYCENTRIC_H
#define KERATIN_SCHEMA_FORMULA_BARYCENTRIC_H

#include "schema/formula/quaternion.h"
#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

KERATIN_FORMULA Real3 barycentric_point(Real3 a, Real3 b, Real3 c, Real u, Real v) {
    return a * (Real(1) - u - v) + b * u + c * v;
}

// The triangle's tangent frame as a rotation: columns s, n, s x n with s the unit direction of the
// edge a -> b and n the unit normal along (b - a) x (c - a). Where the triangle has no area, n is
// some perpendicular of s.
KERATIN_FORMULA Real4 triangle_rotation(Real3 a, Real3 b, Real3 c) {
    Real3 s = normalize_or(b - a, Real3(Real(1), Real(0), Real(0)));
    Real3 n = normalize_or(cross(b - a, c - a), any_perpendicular(s));
    return quaternion_of_columns(s, n, cross(s, n));
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
