// Local shape: the elastic moment at the joint between a segment and the next (METHODS 1.4).
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
#ifndef KERATIN_RUNTIME_FORMULA_BEND_H
#define KERATIN_RUNTIME_FORMULA_BEND_H

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

// h^2 k over the mass per length of the stiffest joint that the system takes: 4e4 times the mass of the
// child's half. Beyond, float would lose the mass in the sums; 32 points of any modulus then sag by
// 0.6 % of 15 cm.
KERATIN_FORMULA Real stiffest_joint(Real child_length) { return Real(2e4) * child_length; }

// h^2 k over the mass per length: stiffness_step = h^2 E I / (density * area), 0 where there is no
// child (child_length 0).
KERATIN_FORMULA Real bend_stiffness(Real stiffness_step, Real parent_half, Real child_length) {
    Bool none = child_length < Real(1e-9);
    Real l = select(none, Real(1), child_length);
    Real k = stiffness_step / ((parent_half + Real(0.5) * l) * (l * l));
    return select(none, Real(0), min(k, stiffest_joint(l)));
}

// How far the grandparent takes part at rest: (t.d) / |a|, not below 0, of the unloaded edges a and
// d.
KERATIN_FORMULA Real bend_lever(Real3 parent, Real3 child) {
    Real square = dot(parent, parent);
    Bool none = square < Real(1e-18);
    return select(none, Real(0), max(Real(0), dot(parent, child)) / select(none, Real(1), square));
}

// What a turn of the parent does to the child beyond that, in strands that are curved at rest:
// |d across t|^2 / |a|^2, and all of |d|^2 / |a|^2 where the child goes back along its parent, which
// the lever leaves out.
KERATIN_FORMULA Real bend_sweep(Real3 parent, Real3 child) {
    Real square = dot(parent, parent);
    Bool none = square < Real(1e-18);
    Real inverse = Real(1) / select(none, Real(1), square);
    Real along = max(Real(0), dot(parent, child) * inverse);
    return select(none, Real(0), max(Real(0), dot(child, child) * inverse - along * along));
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
