// A point against a collider's surface: the push out and Coulomb friction (METHODS 1.4).
#ifndef KERATIN_RUNTIME_FORMULA_CONTACT_H
#define KERATIN_RUNTIME_FORMULA_CONTACT_H

#include "schema/formula/vec3.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// The way out of a depth below the tangent plane of unit normal n for a point at the end of a
// segment of unit direction t and length l: the segment turns about its other end, in the plane of
// t and n, until the point lies in the tangent plane. Straight along n where the way is not short
// against the segment: the plane is no measure of a surface so far off.
KERATIN_FORMULA Real3 way_out(Real3 t, Real l, Real3 n, Real depth) {
    Real sunk = dot(t, n);
    Real wanted = min(sunk + depth / max(l, Real(1e-9)), Real(1));
    Real3 side = normalize_or(t - n * sunk, any_perpendicular(n));
    Real3 turned = n * wanted + side * sqrt(max(Real(0), Real(1) - wanted * wanted));
    return select(depth < l * Real(0.25), (turned - t) * l, n * depth);
}

// Above 0 where that way ends in the tangent plane: it is short, and the segment long enough.
KERATIN_FORMULA Real plane_room(Real3 t, Real l, Real3 n, Real depth) {
    return min(l * Real(0.25) - depth, (Real(1) - dot(t, n)) * l - depth);
}

// Unit direction of a segment of unit direction t and length l whose end moves by `along` in the
// plane of unit normal n through it: it stays in that plane, at its length.
KERATIN_FORMULA Real3 turned_along(Real3 t, Real l, Real3 n, Real3 along) {
    Real height = dot(t, n);
    Real3 level = t - n * height + along * (Real(1) / max(l, Real(1e-9)));
    Real wide = max(Real(0), Real(1) - height * height);
    return n * height + level * sqrt(wide / max(dot(level, level), Real(1e-20)));
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
