#include "tools/measure/solid.h"

#include <algorithm>

namespace keratin::measure {

double signed_distance(const Plane& plane, Point x) {
    return dot(x - plane.point, plane.normal) / length(plane.normal);
}

double signed_distance(const Capsule& capsule, Point x) {
    const Point axis = capsule.b - capsule.a;
    const double square = dot(axis, axis);
    const double t = square > 0 ? std::clamp(dot(x - capsule.a, axis) / square, 0.0, 1.0) : 0;
    return distance(x, capsule.a + axis * t) - capsule.radius;
}

double signed_distance(const Box& box, Point x) {
    const Point d = x - box.center;
    const Point q{std::abs(d.x) - box.half_size.x, std::abs(d.y) - box.half_size.y,
                  std::abs(d.z) - box.half_size.z};
    const Point outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

double signed_distance(const Solid& solid, Point x) {
    return std::visit([&](const auto& shape) { return signed_distance(shape, x); }, solid);
}

}  // namespace keratin::measure
