// Three floats with the handful of operations that drawing needs: a point or direction in metres,
// or a colour in linear light.
#pragma once

#include <algorithm>
#include <cmath>

namespace keratin::view {

struct Float3 {
    float x = 0, y = 0, z = 0;
    bool operator==(const Float3&) const = default;
};

inline Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Float3 operator-(Float3 a) { return {-a.x, -a.y, -a.z}; }
inline Float3 operator*(Float3 a, Float3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Float3 operator*(Float3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Float3 operator*(float s, Float3 a) { return a * s; }
inline Float3& operator+=(Float3& a, Float3 b) { return a = a + b; }

inline float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Float3 cross(Float3 a, Float3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(Float3 a) { return std::sqrt(dot(a, a)); }
// The zero vector stays zero.
inline Float3 normalized(Float3 a) {
    const float n = length(a);
    return n > 0 ? a * (1 / n) : a;
}
inline Float3 mix(Float3 a, Float3 b, float t) { return a + (b - a) * t; }
// Some unit vector at right angles to the unit vector n (Duff et al. 2017, "Building an orthonormal
// basis, revisited").
inline Float3 perpendicular(Float3 n) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1 / (sign + n.z);
    return {1 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x};
}

}  // namespace keratin::view
