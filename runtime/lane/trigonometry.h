// Sine, cosine and angle of a unit vector on lane packs of doubles, branch-free, to about 1e-16.
#pragma once

#include "runtime/lane/lane_double.h"

namespace keratin {

// sin and cos of x, |x| < 1e6. x is reduced by multiples of pi/2 (held in three parts of which the
// first two have 33 bits, so that their products with the multiple are exact); the polynomials are
// Chebyshev fits on [-pi/4, pi/4].
template <class Real>
KERATIN_LANE_INLINE void sin_cos(const Real& x, Real& sine, Real& cosine) {
    const Real n = round(x * Real(0.6366197723675814));
    Real r = sub_mul(x, n, Real(1.5707963267341256));
    r = sub_mul(r, n, Real(6.077100506303966e-11));
    r = sub_mul(r, n, Real(2.0222662487959506e-21));
    const Real y = r * r;
    Real s = mul_add(y, Real(1.59153232122714e-10), Real(-2.5051092507061385e-08));
    s = mul_add(y, s, Real(2.755731591191116e-06));
    s = mul_add(y, s, Real(-0.00019841269836387345));
    s = mul_add(y, s, Real(0.0083333333333307));
    s = mul_add(y, s, Real(-0.16666666666666666));
    s = mul_add(r * y, s, r);
    Real c = mul_add(y, Real(-1.1380876948169717e-11), Real(2.087612165887116e-09));
    c = mul_add(y, c, Real(-2.755731715246704e-07));
    c = mul_add(y, c, Real(2.4801587298533456e-05));
    c = mul_add(y, c, Real(-0.0013888888888887241));
    c = mul_add(y, c, Real(0.041666666666666664));
    c = mul_add(y * y, c, sub_mul(Real(1.0), y, Real(0.5)));
    // quarter turns n mod 4 as -1, 0, 1, 2 (or -2): odd ones exchange sine and cosine
    const Real quarter = sub_mul(n, Real(4.0), round(n * Real(0.25)));
    const auto odd = abs(abs(quarter) - Real(1.0)) < Real(0.5);
    const Real sin_size = select(odd, c, s), cos_size = select(odd, s, c);
    const auto negate_sin = (quarter < Real(-0.5)) | (quarter > Real(1.5));
    const auto negate_cos = (quarter > Real(0.5)) | (quarter < Real(-1.5));
    sine = select(negate_sin, -sin_size, sin_size);
    cosine = select(negate_cos, -cos_size, cos_size);
}

// The angle in [-pi, pi] whose sine and cosine are given, sine^2 + cosine^2 = 1 to rounding: folded
// to angle <= pi/2 first; tan(angle/2) = sine/(1 + cosine), beyond pi/8 less pi/4.
template <class Real>
KERATIN_LANE_INLINE Real angle_of(const Real& sine, const Real& cosine) {
    const Real s = abs(sine), c = abs(cosine) + Real(1.0);
    const auto beyond = s > Real(0.4142135623730951) * c;
    const Real w = select(beyond, s - c, s) / select(beyond, s + c, c);  // at most tan(pi/8)
    const Real y = w * w;
    // even and odd powers of y side by side
    const Real z = y * y;
    Real even = mul_add(z, Real(-0.01905402725684994), Real(-0.05081948211975355));
    Real odd = mul_add(z, Real(0.03913092044526708), Real(0.05857476994143512));
    even = mul_add(z, even, Real(-0.06664433776587356));
    odd = mul_add(z, odd, Real(0.07692177653697398));
    even = mul_add(z, even, Real(-0.0909090433877704));
    odd = mul_add(z, odd, Real(0.11111111009341013));
    even = mul_add(z, even, Real(-0.1428571428459269));
    odd = mul_add(z, odd, Real(0.19999999999995166));
    even = mul_add(z, even, Real(-0.3333333333333333));
    const Real p = mul_add(y, odd, even);
    const Real twice = Real(2.0) * mul_add(w * y, p, w);
    const Real angle = select(beyond, Real(1.5707963267948966) + twice, twice);
    return copy_sign(select(cosine < Real(0.0), Real(3.141592653589793) - angle, angle), sine);
}

}  // namespace keratin
