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

// What a point fills of a voxel: `scaled` of its length, at the density rho of the groom at rest; 0
// where that is not known. Beyond 64 the fixed point of 32 bits would end.
KERATIN_FORMULA Real filled_share(Real scaled, Real rho) {
    Bool known = Real(0) < rho;
    return min(select(known, scaled / select(known, rho, Real(1)), Real(0)), Real(64));
}

// Part of a point's own share that it reads back at its place, along one axis: f of the way between
// two voxels.
KERATIN_FORMULA Real own_part(Real f) { return f * f + (Real(1) - f) * (Real(1) - f); }

// -k grad(e^2 / 2), not larger than `limit`: e is how much more is filled than in the groom at rest
// and a quarter, of it and of full: hair that has moved meets other voxels, which alone changes
// what it reads by some tenths.
KERATIN_FORMULA Real3 volume_acceleration(Real filling, Real rest, Real3 gradient, Real k,
                                          Real limit) {
    Real excess = max(Real(0), filling - rest * Real(1.25) - Real(0.25));
    Real3 a = gradient * (-k * excess);
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
