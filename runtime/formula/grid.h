// Between points and the grid: the cell of a point and what the grid gives back (METHODS 1.2, 1.3).
#ifndef KERATIN_RUNTIME_FORMULA_GRID_H
#define KERATIN_RUNTIME_FORMULA_GRID_H

#include "schema/formula/vec3.h"
#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// Largest whole number not above s, for |s| < 2^22.
KERATIN_FORMULA Real floor_of(Real s) {
    Real rounded = round_even(s);
    return select(s < rounded, rounded - Real(1), rounded);
}

// The blend towards the grid's mean displacement: lerp(d, mean, friction share of the step).
KERATIN_FORMULA Real3 rubbed(Real3 displacement, Real3 mean, Real share) {
    return displacement + (mean - displacement) * share;
}

// -k grad(filling), not larger than `limit`.
KERATIN_FORMULA Real3 volume_acceleration(Real3 gradient, Real k, Real limit) {
    Real3 a = gradient * (-k);
    Real square = dot(a, a);
    Bool over = limit * limit < square;
    Real shrink = limit / sqrt(select(over, square, Real(1)));
    return a * select(over, shrink, Real(1));
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
