// A point against a collider's surface: the push out and Coulomb friction (METHODS 1.4).
#ifndef KERATIN_RUNTIME_FORMULA_CONTACT_H
#define KERATIN_RUNTIME_FORMULA_CONTACT_H

#include "schema/formula/vec3.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// The way out of a depth below the tangent plane of unit normal n: across the segment of direction
// t and length l, so that putting the point back at its distance from the parent undoes next to
// nothing of it; straight along n where the segment points into the surface or the way is not short
// against it.
KERATIN_FORMULA Real3 way_out(Real3 t, Real l, Real3 n, Real depth) {
    Real3 across = n - t * dot(n, t);
    Real square = dot(across, across);
    Bool turns = depth < select(Real(0.0625) < square, l * Real(0.25), Real(0));
    return select(turns, across, n) * (depth / select(turns, square, Real(1)));
}

// Friction of a point pushed out by `depth` along the unit normal n: its displacement u relative to
// the surface loses up to friction * depth of its tangential part, and all of it below that (the
// push is the normal impulse times h / m, so this is the Coulomb law of the step). 0 where depth is
// not above 0.
KERATIN_FORMULA Real3 friction_move(Real3 u, Real3 n, Real depth, Real friction) {
    Real3 tangential = u - n * dot(u, n);
    Real slide = sqrt(dot(tangential, tangential));
    Real allowed = friction * max(Real(0), depth);
    Bool sticks = slide < allowed;
    Real share = select(sticks, Real(1), allowed / max(slide, Real(1e-20)));
    return -(tangential * share);
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
