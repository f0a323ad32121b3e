// Vectors of three and four numbers, with the few operations that formulas need, under the names
// that GLSL has built in. In C++ a number is float, double or a lane pack (runtime/lane).
#ifndef KERATIN_SCHEMA_FORMULA_VEC3_H
#define KERATIN_SCHEMA_FORMULA_VEC3_H

#ifdef __cplusplus
#include <cmath>
#include <cstddef>

#define KERATIN_ALWAYS_INLINE __attribute__((always_inline)) inline

namespace keratin {

using std::sqrt;

// Chooses without a branch: a where the condition holds, b elsewhere.
KERATIN_ALWAYS_INLINE float select(bool c, float a, float b) { return c ? a : b; }
KERATIN_ALWAYS_INLINE double select(bool c, double a, double b) { return c ? a : b; }

// As the vector instructions have them: the second argument when one is not a number.
KERATIN_ALWAYS_INLINE float min(float a, float b) { return a < b ? a : b; }
KERATIN_ALWAYS_INLINE float max(float a, float b) { return a > b ? a : b; }
KERATIN_ALWAYS_INLINE double min(double a, double b) { return a < b ? a : b; }
KERATIN_ALWAYS_INLINE double max(double a, double b) { return a > b ? a : b; }
// The nearest whole number, ties to the even one, for |a| < 2^22: adding 1.5 * 2^23 leaves no bits
// for the rest. The same in every instruction set; GLSL has roundEven.
KERATIN_ALWAYS_INLINE float round_even(float a) { return (a + 12582912.0f) - 12582912.0f; }
KERATIN_ALWAYS_INLINE double round_even(double a) {
    return (a + 6755399441055744.0) - 6755399441055744.0;
}
KERATIN_ALWAYS_INLINE float abs(float a) { return std::fabs(a); }
KERATIN_ALWAYS_INLINE double abs(double a) { return std::fabs(a); }

template <class Real>
struct Vec3 {
    Real x, y, z;

    Vec3() = default;
    KERATIN_ALWAYS_INLINE Vec3(Real x_, Real y_, Real z_) : x(x_), y(y_), z(z_) {}
    KERATIN_ALWAYS_INLINE explicit Vec3(Real a) : x(a), y(a), z(a) {}

    KERATIN_ALWAYS_INLINE Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
    KERATIN_ALWAYS_INLINE Vec3& operator-=(const Vec3& b) { return *this = *this - b; }
    KERATIN_ALWAYS_INLINE Vec3& operator*=(Real s) { return *this = *this * s; }

    friend KERATIN_ALWAYS_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) {
        return Vec3(a.x + b.x, a.y + b.y, a.z + b.z);
    }
    friend KERATIN_ALWAYS_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) {
        return Vec3(a.x - b.x, a.y - b.y, a.z - b.z);
    }
    friend KERATIN_ALWAYS_INLINE Vec3 operator-(const Vec3& a) { return Vec3(-a.x, -a.y, -a.z); }
    friend KERATIN_ALWAYS_INLINE Vec3 operator*(const Vec3& a, Real s) {
        return Vec3(a.x * s, a.y * s, a.z * s);
    }
    friend KERATIN_ALWAYS_INLINE Vec3 operator*(Real s, const Vec3& a) { return a * s; }
};

template <class Real>
struct Vec4 {
    Real x, y, z, w;

    Vec4() = default;
    KERATIN_ALWAYS_INLINE Vec4(Real x_, Real y_, Real z_, Real w_) : x(x_), y(y_), z(z_), w(w_) {}

    friend KERATIN_ALWAYS_INLINE Vec4 operator+(const Vec4& a, const Vec4& b) {
        return Vec4(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w);
    }
    friend KERATIN_ALWAYS_INLINE Vec4 operator-(const Vec4& a, const Vec4& b) {
        return Vec4(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w);
    }
    friend KERATIN_ALWAYS_INLINE Vec4 operator-(const Vec4& a) {
        return Vec4(-a.x, -a.y, -a.z, -a.w);
    }
    friend KERATIN_ALWAYS_INLINE Vec4 operator*(const Vec4& a, Real s) {
        return Vec4(a.x * s, a.y * s, a.z * s, a.w * s);
    }
};

template <class Real>
KERATIN_ALWAYS_INLINE Real dot(const Vec3<Real>& a, const Vec3<Real>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
KERATIN_ALWAYS_INLINE Real dot(const Vec4<Real>& a, const Vec4<Real>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}
template <class Real>
KERATIN_ALWAYS_INLINE Vec3<Real> cross(const Vec3<Real>& a, const Vec3<Real>& b) {
    return Vec3<Real>(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
template <class Real>
KERATIN_ALWAYS_INLINE Real length(const Vec3<Real>& a) {
    return sqrt(dot(a, a));
}
template <class Condition, class Real>
KERATIN_ALWAYS_INLINE Vec3<Real> select(const Condition& c, const Vec3<Real>& a,
                                        const Vec3<Real>& b) {
    return Vec3<Real>(select(c, a.x, b.x), select(c, a.y, b.y), select(c, a.z, b.z));
}
template <class Condition, class Real>
KERATIN_ALWAYS_INLINE Vec4<Real> select(const Condition& c, const Vec4<Real>& a,
                                        const Vec4<Real>& b) {
    return Vec4<Real>(select(c, a.x, b.x), select(c, a.y, b.y), select(c, a.z, b.z),
                      select(c, a.w, b.w));
}

}  // namespace keratin
#else
float round_even(float a) { return roundEven(a); }
float select(bool c, float a, float b) { return c ? a : b; }
vec3 select(bool c, vec3 a, vec3 b) { return c ? a : b; }
vec4 select(bool c, vec4 a, vec4 b) { return c ? a : b; }
#endif

#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// a / |a|; `fallback` where a is shorter than 1e-18 (whose square is the smallest that float
// keeps).
KERATIN_FORMULA Real3 normalize_or(Real3 a, Real3 fallback) {
    Real square = dot(a, a);
    Bool tiny = square < Real(1e-36);
    Real inverse = Real(1) / sqrt(select(tiny, Real(1), square));
    return select(tiny, fallback, a * inverse);
}

// A unit vector perpendicular to the unit vector t, continuous but for one direction (Duff et al.
// 2017): (1 + s z, ...) with s the sign of t.z.
KERATIN_FORMULA Real3 any_perpendicular(Real3 t) {
    Real s = select(t.z < Real(0), Real(-1), Real(1));
    Real a = Real(-1) / (s + t.z);
    return Real3(Real(1) + s * t.x * t.x * a, s * t.x * t.y * a, -s * t.x);
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
