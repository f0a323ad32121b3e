// A point of a render strand: the rest pose carried by its own root, moved by the weighted
// displacement of three guides from their carried rest poses (METHODS 1.5).
#ifndef KERATIN_RUNTIME_FORMULA_INTERPOLATE_H
#define KERATIN_RUNTIME_FORMULA_INTERPOLATE_H

#include "schema/formula/quaternion.h"

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

KERATIN_FORMULA Real3 carried(Real4 rotation, Real3 translation, Real3 rest) {
    return rotate(rotation, rest) + translation;
}

KERATIN_FORMULA Real3 weighted_displacement(Real3 a, Real3 b, Real3 c, Real wa, Real wb, Real wc) {
    return a * wa + b * wb + c * wc;
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
