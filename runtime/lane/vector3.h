// Vectors of three numbers, each a double or a lane pack.
#pragma once

#include "runtime/lane/lane_double.h"

namespace keratin {

template <class Real>
struct Vector3 {
    Real x, y, z;
    KERATIN_LANE_INLINE friend Vector3 operator+(const Vector3& a, const Vector3& b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    KERATIN_LANE_INLINE friend Vector3 operator-(const Vector3& a, const Vector3& b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    KERATIN_LANE_INLINE friend Vector3 operator-(const Vector3& a) { return {-a.x, -a.y, -a.z}; }
    KERATIN_LANE_INLINE friend Vector3 operator*(const Real& s, const Vector3& a) {
        return {s * a.x, s * a.y, s * a.z};
    }
};

template <class Real>
KERATIN_LANE_INLINE Real dot(const Vector3<Real>& a, const Vector3<Real>& b) {
    return mul_add(a.x, b.x, mul_add(a.y, b.y, a.z * b.z));
}
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> cross(const Vector3<Real>& a, const Vector3<Real>& b) {
    return {sub_mul(a.y * b.z, a.z, b.y), sub_mul(a.z * b.x, a.x, b.z),
            sub_mul(a.x * b.y, a.y, b.x)};
}
// s a + b
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> mul_add(const Real& s, const Vector3<Real>& a,
                                          const Vector3<Real>& b) {
    return {mul_add(s, a.x, b.x), mul_add(s, a.y, b.y), mul_add(s, a.z, b.z)};
}
template <class Mask, class Real>
KERATIN_LANE_INLINE Vector3<Real> select(Mask m, const Vector3<Real>& a, const Vector3<Real>& b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

}  // namespace keratin
