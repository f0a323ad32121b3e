// Arithmetic on Double3, for the parts of the rod solver that run once a strand.
#pragma once

#include "runtime/rod/rod_strand.h"

#include <cmath>

namespace keratin {

inline Double3 add(const Double3& a, const Double3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Double3 subtract(const Double3& a, const Double3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Double3 scaled(double s, const Double3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(const Double3& a, const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Double3 cross(const Double3& a, const Double3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Double3& a) { return std::sqrt(dot(a, a)); }
inline Double3 unit(const Double3& a) { return scaled(1 / length(a), a); }
inline bool is_finite(const Double3& a) {
    return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

// v made perpendicular to the unit vector t, and unit.
inline Double3 across(const Double3& v, const Double3& t) { return unit(subtract(v, scaled(dot(v, t), t))); }

// A fixed perpendicular of the unit vector t: from the axis that t leans on least.
inline Double3 any_normal(const Double3& t) {
    const double x = std::fabs(t[0]), y = std::fabs(t[1]), z = std::fabs(t[2]);
    const Double3 axis = x <= y && x <= z ? Double3{1, 0, 0} : y <= z ? Double3{0, 1, 0} : Double3{0, 0, 1};
    return across(axis, t);
}

// v turned by the rotation vector w (axis times angle).
inline Double3 turned(const Double3& w, const Double3& v) {
    const double angle = length(w);
    if (angle == 0) return v;
    const Double3 k = scaled(1 / angle, w);
    const double c = std::cos(angle), s = std::sin(angle);
    return add(add(scaled(c, v), scaled(s, cross(k, v))), scaled((1 - c) * dot(k, v), k));
}

}  // namespace keratin
