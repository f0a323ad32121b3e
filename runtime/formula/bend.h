// Local shape: the elastic moment at the joint between a segment and the next (METHODS 1.4).
//
// Joint at point i with the parent a = x_i - x_{i-1}, the child e = x_{i+1} - x_i, the parent's
// frame Q and the child's rest edge d in that frame:
//     C = e - Q d,   energy k |C|^2 / 2,   k = E I / (lbar |e_rest|^2),
// lbar half the sum of both rest lengths, half of the child's at the clamp. The force on x_{i+1} is
// -k C, on x_{i-1} -J^T k C, on x_i the opposite of both; J is what C does when the parent turns.
#ifndef KERATIN_RUNTIME_FORMULA_BEND_H
#define KERATIN_RUNTIME_FORMULA_BEND_H

#include "schema/formula/frame.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// J^T y = ((t.g) y - g (t.y)) / |a| with g = Q d and t = a / |a|.
KERATIN_FORMULA Real3 bend_reaction(Real3 t, Real inverse_length, Real3 g, Real3 y) {
    return (y * dot(t, g) - g * dot(t, y)) * inverse_length;
}

// h^2 k over the mass per length: stiffness_step = h^2 E I / (density * area), 0 where there is no
// child (child_length 0).
KERATIN_FORMULA Real bend_stiffness(Real stiffness_step, Real parent_half, Real child_length) {
    Bool none = child_length < Real(1e-9);
    Real l = select(none, Real(1), child_length);
    return select(none, Real(0), stiffness_step / ((parent_half + Real(0.5) * l) * (l * l)));
}

// How far the grandparent takes part, with frames at rest: (t.g) / |a|, not below 0.
KERATIN_FORMULA Real bend_lever(Real3 rest_child, Real parent_length) {
    Bool none = parent_length < Real(1e-9);
    return max(Real(0), rest_child.x) / select(none, Real(1), parent_length);
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
