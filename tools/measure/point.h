// Points and polylines as measures take them: double precision, no tiles.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace keratin::measure {

struct Point {
    double x = 0, y = 0, z = 0;
    bool operator==(const Point&) const = default;
};

inline Point operator+(Point a, Point b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point operator*(Point a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(Point a, Point b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Point cross(Point a, Point b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Point a) { return std::sqrt(dot(a, a)); }
inline double distance(Point a, Point b) { return length(a - b); }

// Strands side by side: strand s has the points first_point[s] .. first_point[s + 1], root first.
struct Strands {
    std::span<const std::uint32_t> first_point;  // [strands + 1], ascending from 0
    std::span<const Point> position;             // [points] m

    std::size_t count() const { return first_point.empty() ? 0 : first_point.size() - 1; }
    std::span<const Point> strand(std::size_t s) const {
        return position.subspan(first_point[s], first_point[s + 1] - first_point[s]);
    }
};

// x -> R x + T with the unit quaternion (x, y, z, w).
struct Rigid {
    Point translation;
    double x = 0, y = 0, z = 0, w = 1;
};

inline Point turn(const Rigid& m, Point p) {
    const Point v{m.x, m.y, m.z};
    const Point t = cross(v, p) * 2;
    return p + t * m.w + cross(v, t);
}
inline Point apply(const Rigid& m, Point p) { return turn(m, p) + m.translation; }
inline Point apply_inverse(const Rigid& m, Point p) {
    return turn({{}, -m.x, -m.y, -m.z, m.w}, p - m.translation);
}

}  // namespace keratin::measure
