// Frames along a strand. The root frame has the columns (t, u, v): t the unit direction of the
// first edge, u the director stored with the asset (guide_shape, row 0), v = t x u. It is carried
// along the strand by minimal rotations (Bishop frame): Q_j = P(t_{j-1}, t_j) Q_{j-1}.
#ifndef KERATIN_SCHEMA_FORMULA_FRAME_H
#define KERATIN_SCHEMA_FORMULA_FRAME_H

#include "schema/formula/vec3.h"
#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// P(a, b) v of METHODS: v turned by the minimal rotation that takes the unit vector a to the unit
// vector b: c v + k x v + k (k.v) / (1 + c), k = a x b, c = a.b. For 1 + c < 1e-7 (a and b
// opposite) v is turned by half a turn about the unit vector `axis`, which must be perpendicular to
// a.
KERATIN_FORMULA Real3 minimal_rotation(Real3 a, Real3 b, Real3 axis, Real3 v) {
    Real c = dot(a, b);
    Real3 k = cross(a, b);
    Bool opposite = Real(1) + c < Real(1e-7);
    Real inverse = Real(1) / select(opposite, Real(1), Real(1) + c);
    Real3 turned = v * c + cross(k, v) + k * (dot(k, v) * inverse);
    Real3 half_turn = axis * (Real(2) * dot(axis, v)) - v;
    return select(opposite, half_turn, turned);
}

// The same in the form v - ((a + b).v) / (1 + c) (a + b) + 2 (a.v) b, for where a and b are not
// opposite; within 1e-3 rad of it the result is still bounded and continuous, but not a rotation.
KERATIN_FORMULA Real3 minimal_turn(Real3 a, Real3 b, Real3 v) {
    Real3 sum = a + b;
    Real share = dot(sum, v) / max(Real(1) + dot(a, b), Real(1e-6));
    return v - sum * share + b * (Real(2) * dot(a, v));
}

// The same for a director u perpendicular to a. Half turns are about u itself: u stays.
//   P(a, b) u = u - (b.u) / (1 + c) (a + b), from P v = v - ((a+b).v)/(1+c) (a+b) + 2 (a.v) b.
// Rounding moves it by about 1e-7 a call, which over the at most 32 segments of a strand is far
// below what is seen; it starts anew from the root's director each time.
KERATIN_FORMULA Real3 transport_director(Real3 a, Real3 b, Real3 u) {
    Real c = dot(a, b);
    Bool opposite = Real(1) + c < Real(1e-7);
    Real share = dot(b, u) / select(opposite, Real(1), Real(1) + c);
    return u - (a + b) * select(opposite, Real(0), share);
}

// A unit director perpendicular to the unit direction t, as near to u as can be.
KERATIN_FORMULA Real3 orthonormal_director(Real3 t, Real3 u) {
    return normalize_or(u - t * dot(t, u), any_perpendicular(t));
}

// Components of v in the frame (t, u, t x u), and back.
KERATIN_FORMULA Real3 to_frame(Real3 t, Real3 u, Real3 v) {
    return Real3(dot(t, v), dot(u, v), dot(cross(t, u), v));
}
KERATIN_FORMULA Real3 from_frame(Real3 t, Real3 u, Real3 c) {
    return t * c.x + u * c.y + cross(t, u) * c.z;
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
