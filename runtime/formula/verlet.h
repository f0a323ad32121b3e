// One step of a free point (METHODS 1.3).
#ifndef KERATIN_RUNTIME_FORMULA_VERLET_H
#define KERATIN_RUNTIME_FORMULA_VERLET_H

#include "schema/formula/vec3.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// x+ - x = (x - x_previous) carry + a half_square with carry = (h/h-) (1 - damping)^(60 h) and
// half_square = h (h + h-) / 2: exact for constant a and any sequence of steps.
KERATIN_FORMULA Real3 verlet_move(Real3 x, Real3 previous, Real carry, Real3 acceleration,
                                  Real half_square) {
    return (x - previous) * carry + acceleration * half_square;
}

// The part of a point's move that a step can resolve: beside its parent's move it turns their segment
// of length l by at most 0.2 rad. What turns faster (12 m/s across a 5 mm segment at 240 small steps a
// second; nothing that a head does) is far beyond what linearised bending and lengths can follow: left
// alone it feeds energy in, and a strand that was once folded or hit hard lashes about for ever.
KERATIN_FORMULA Real longest_turn(Real l) { return Real(0.2) * l; }
KERATIN_FORMULA Real3 resolved_move(Real3 move, Real3 parent_move, Real longest) {
    Real3 beside = move - parent_move;
    Real square = dot(beside, beside);
    Bool fast = longest * longest < square;
    Real share = longest / sqrt(select(fast, square, Real(1)));
    return select(fast, parent_move + beside * share, move);
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
