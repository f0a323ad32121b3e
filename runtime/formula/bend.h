// Local shape over a small step (METHODS 1.4): joints' stiffness times h^2, and their rows of the
// bending system. The moment itself: schema/bend.h.
#ifndef KERATIN_RUNTIME_FORMULA_BEND_H
#define KERATIN_RUNTIME_FORMULA_BEND_H

#include "schema/bend.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// h^2 k over the mass per length of the stiffest joint that the system takes: 4e4 times the mass of
// the child's half. Beyond, float would lose the mass in the sums; the weight that such a joint
// carries is held back with it (carried_weight).
KERATIN_FORMULA Real stiffest_joint(Real child_length) { return Real(2e4) * child_length; }

// h^2 k over the mass per length: stiffness_step = h^2 E I / (density * area), 0 where there is no
// child (child_length 0).
KERATIN_FORMULA Real bend_stiffness(Real stiffness_step, Real parent_half, Real child_length) {
    Bool none = child_length < Real(1e-9);
    Real l = select(none, Real(1), child_length);
    Real k = joint_stiffness(stiffness_step, parent_half, l);
    return select(none, Real(0), min(k, stiffest_joint(l)));
}

// What the weight beyond a joint counts where its stiffness is held back: the share of the stiffness
// that is left, so that it bends by as much as it should.
KERATIN_FORMULA Real carried_weight(Real stiffness_step, Real parent_half, Real child_length) {
    Real l = max(child_length, Real(1e-9));
    Real k = max(joint_stiffness(stiffness_step, parent_half, l), Real(1e-30));
    return min(Real(1), stiffest_joint(l) / k);
}

// How far the grandparent takes part at rest: (t.d) / |a|, not below 0, of the unloaded edges a and
// d.
KERATIN_FORMULA Real bend_lever(Real3 parent, Real3 child) {
    Real square = dot(parent, parent);
    Bool none = square < Real(1e-18);
    return select(none, Real(0), max(Real(0), dot(parent, child)) / select(none, Real(1), square));
}

// What a turn of the parent does to the child beyond that, in strands that are curved at rest:
// |d across t|^2 / |a|^2, and all of |d|^2 / |a|^2 where the child goes back along its parent,
// which the lever leaves out.
KERATIN_FORMULA Real bend_sweep(Real3 parent, Real3 child) {
    Real square = dot(parent, parent);
    Bool none = square < Real(1e-18);
    Real inverse = Real(1) / select(none, Real(1), square);
    Real along = max(Real(0), dot(parent, child) * inverse);
    return select(none, Real(0), max(Real(0), dot(child, child) * inverse - along * along));
}

// h^2 times what the weight beyond a segment resists its turning sideways with, per line density
// (m): beyond g.e / l^2 of a segment e that hangs by `hangs` = h^2 g.e (m^2), 0 where it stands up.
// Without it in the matrix the weight acts as an explicit force, and hair as soft as a chain lashes
// about for ever. Where it is small against the mass, a quarter of it is taken (the average
// acceleration of Newmark's method): all of it slows a swing by more, and the more the longer the
// step.
KERATIN_FORMULA Real weight_stiffness(Real hangs, Real beyond, Real l) {
    Bool none = l < Real(1e-9);
    Real length = select(none, Real(1), l);
    Real all = max(hangs, Real(0)) * beyond / (length * length);
    return select(none, Real(0), all * ((Real(0.25) * length + all) / (length + all)));
}

// How much of the joint's force k (|d| u - g) along the child's direction u enters the solve, in
// place of |d|: along = u.g leaves none, as a segment under tension holds it. The solve would move
// points along the strand, the length sweeps bring them back against other masses, and what both
// leave pulls like a tension that straightens.
//   held    1 where segments have tension, else 0: then all of it enters
KERATIN_FORMULA Real bend_pull(Real length, Real along, Real held) {
    return length + held * (along - length);
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
