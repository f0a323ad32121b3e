// Segment lengths (METHODS 1.4): the linear system of all stretch constraints of a strand, and the
// pull towards the parent (global length, Müller et al. 2012).
#ifndef KERATIN_RUNTIME_FORMULA_LENGTH_H
#define KERATIN_RUNTIME_FORMULA_LENGTH_H

#include "schema/formula/vec3.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// Inverse of the mass per length that stands at a point: half of either neighbouring segment.
KERATIN_FORMULA Real inverse_point_mass(Real length_above, Real length_below) {
    Real m = Real(0.5) * (length_above + length_below);
    Bool none = length_above < Real(1e-9);
    return select(none, Real(0), Real(1) / select(none, Real(1), m));
}

// How far a point moves along its segment e towards its parent so that the segment regains the
// length l, when too long: (l / |e| - 1) e; 0 when too short.
KERATIN_FORMULA Real3 pull_to_parent(Real3 e, Real l) {
    Real square = dot(e, e);
    Bool longer = l * l < square;
    Real shrink = l / sqrt(select(longer, square, Real(1))) - Real(1);
    return e * select(longer, shrink, Real(0));
}

// e with the length l; along `fallback` (unit) where e has none.
KERATIN_FORMULA Real3 with_length(Real3 e, Real l, Real3 fallback) {
    return normalize_or(e, fallback) * l;
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
