// Signed distance of a point to simple solids and the outward unit normal there: negative inside.
#ifndef KERATIN_RUNTIME_SHAPE_DISTANCE_H
#define KERATIN_RUNTIME_SHAPE_DISTANCE_H

#include "schema/formula/vec3.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// Capsule from a to a + ab (ab = 0: a sphere) with radius r; inverse_square = 1 / |ab|^2, or 0.
// At the core itself the normal is some unit vector.
KERATIN_FORMULA Real capsule_distance(Real3 p, Real3 a, Real3 ab, Real inverse_square, Real r,
                                      KERATIN_OUT(Real3, normal)) {
    Real3 ap = p - a;
    Real s = min(max(dot(ap, ab) * inverse_square, Real(0)), Real(1));
    Real3 d = ap - ab * s;
    Real square = dot(d, d);
    Bool core = square < Real(1e-24);
    Real distance = sqrt(select(core, Real(1), square));
    Real3 outward = d * (Real(1) / distance);
    normal = select(core, Real3(Real(0), Real(1), Real(0)), outward);
    return select(core, Real(0), distance) - r;
}

// Square of the distance of p to the core of that capsule.
KERATIN_FORMULA Real capsule_square(Real3 p, Real3 a, Real3 ab, Real inverse_square) {
    Real3 ap = p - a;
    Real s = min(max(dot(ap, ab) * inverse_square, Real(0)), Real(1));
    Real3 d = ap - ab * s;
    return dot(d, d);
}

// Half space below the plane through `point` with the unit normal n.
KERATIN_FORMULA Real plane_distance(Real3 p, Real3 point, Real3 n, KERATIN_OUT(Real3, normal)) {
    normal = n;
    return dot(p - point, n);
}

// Box of half size s about the origin of its own axes. Inside, the nearest face decides.
KERATIN_FORMULA Real box_distance(Real3 p, Real3 s, KERATIN_OUT(Real3, normal)) {
    Real3 sign =
        Real3(select(p.x < Real(0), Real(-1), Real(1)), select(p.y < Real(0), Real(-1), Real(1)),
              select(p.z < Real(0), Real(-1), Real(1)));
    Real3 q = Real3(abs(p.x) - s.x, abs(p.y) - s.y, abs(p.z) - s.z);
    Real3 out_part = Real3(max(q.x, Real(0)), max(q.y, Real(0)), max(q.z, Real(0)));
    Real outside = sqrt(dot(out_part, out_part));
    Real inside = max(q.x, max(q.y, q.z));
    Bool is_inside = inside < Real(0);
    // Face normal of the largest q: x before y before z on ties.
    Bool y_over_x = q.x < q.y;
    Real xy = max(q.x, q.y);
    Bool z_over_xy = xy < q.z;
    Real3 face =
        select(z_over_xy, Real3(Real(0), Real(0), sign.z),
               select(y_over_x, Real3(Real(0), sign.y, Real(0)), Real3(sign.x, Real(0), Real(0))));
    Real inverse = Real(1) / max(outside, Real(1e-20));
    Real3 corner = Real3(out_part.x * sign.x * inverse, out_part.y * sign.y * inverse,
                         out_part.z * sign.z * inverse);
    Bool on_face = outside < Real(1e-20);
    normal = select(is_inside, face, select(on_face, face, corner));
    return select(is_inside, inside, outside);
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
