// One step of a free point (METHODS 1.3).
#ifndef KERATIN_RUNTIME_FORMULA_VERLET_H
#define KERATIN_RUNTIME_FORMULA_VERLET_H

#include "schema/formula/vec3.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// x+ = x + (x - x_previous) carry + a half_square with carry = (h/h-) (1 - damping)^(60 h) and
// half_square = h (h + h-) / 2: exact for constant a and any sequence of steps.
KERATIN_FORMULA Real3 verlet(Real3 x, Real3 previous, Real carry, Real3 acceleration,
                             Real half_square) {
    return x + (x - previous) * carry + acceleration * half_square;
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
