// Local shape: what the rest edges of an asset (guide_shape) mean to the strand solver, the elastic
// moment at the joint between a segment and the next (METHODS 1.4). Shared by the solver's passes
// and by the bake, which chooses rest edges whose moments carry the weight (bake/stage/sag_free.h).
//
// Joint at point i with the parent a = x_i - x_{i-1}, its direction t, and the child's direction e:
//     C = |d| e - g,   g = P(r, t) d,   energy k |C|^2 / 2,   k = E I / (lbar |d|^2),
// r the parent's direction and d the child's edge in the unloaded shape carried by the root, P the
// minimal rotation, lbar half the sum of both rest lengths, half of the child's at the clamp.
//
// Deviation: METHODS carries the frame along the strand, Q_j = P(t_{j-1}, t_j) Q_{j-1}. In the
// plane and for straight hair that is the same. But a curled strand's every segment would then turn
// all frames further out without feeling their moments, and these forces that follow feed energy
// in: curls flutter. g here depends on one segment, which feels all of it (bend_reaction).
#ifndef KERATIN_SCHEMA_BEND_H
#define KERATIN_SCHEMA_BEND_H

#include "schema/formula/frame.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// 1 / (1 + r.t), which both formulas below take: bounded where t has turned right round.
KERATIN_FORMULA Real bend_inverse(Real3 r, Real3 t) {
    return Real(1) / max(Real(1) + dot(r, t), Real(1e-6));
}

// g = P(r, t) d = d - ((r + t).d) / (1 + r.t) (r + t) + 2 (r.d) t; along = r.d is the same at any
// time, inverse = bend_inverse(r, t).
KERATIN_FORMULA Real3 bend_target(Real3 r, Real3 t, Real3 d, Real along, Real inverse) {
    Real share = (along + dot(t, d)) * inverse;
    return d - r * share + t * (along + along - share);
}

// What the moment y = k (|d| u - g) on the child, u its direction, does to the parent:
// (dg/da)^T y = k |d| (dg/da)^T u, as g keeps its length, with
//     dg = w x g,   w = (t x da + t (t x r).da / (1 + r.t)) / |a|.
// The first part turns t along with a; the second is the twist that P gains on the way, bounded
// where r and t are nearly opposite. scale = k |d| / |a|; t.g = r.d = along, as P is a rotation.
KERATIN_FORMULA Real3 bend_reaction(Real3 r, Real3 t, Real3 g, Real3 u, Real along, Real inverse,
                                    Real scale) {
    Real3 swing = u * along - g * dot(t, u);
    Real twist = dot(u, cross(t, g)) * min(inverse, Real(10));
    return (swing + cross(t, r) * twist) * scale;
}

// Stiffness k of a joint out of E I over the mass per length: l the child's length, parent_half
// half of the parent's, 0 at the clamp.
KERATIN_FORMULA Real joint_stiffness(Real bending, Real parent_half, Real l) {
    return bending / ((parent_half + Real(0.5) * l) * (l * l));
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
