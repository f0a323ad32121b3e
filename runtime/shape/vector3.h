// Vectors of doubles for distances and contacts, on schema/formula/vec3.h.
#pragma once

#include "schema/formula/vec3.h"

namespace keratin {

using Vector3 = Vec3<double>;

template <class Real>
Real squared_length(const Vec3<Real>& a) {
    return dot(a, a);
}

// a + t (b - a)
template <class Real>
Vec3<Real> mix(const Vec3<Real>& a, const Vec3<Real>& b, Real t) {
    return a + (b - a) * t;
}

}  // namespace keratin
