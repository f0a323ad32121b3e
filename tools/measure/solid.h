// Signed distances to solids with a formula, negative inside: what a run's colliders are measured
// with, apart from the code that pushes strands out of them.
#pragma once

#include "tools/measure/point.h"

#include <variant>

namespace keratin::measure {

struct Plane {
    Point point, normal;  // normal of any length, out of the solid side
};
struct Capsule {  // a sphere when a == b
    Point a, b;
    double radius = 0;
};
struct Box {
    Point center, half_size;
};
using Solid = std::variant<Plane, Capsule, Box>;

double signed_distance(const Plane& plane, Point x);
double signed_distance(const Capsule& capsule, Point x);
double signed_distance(const Box& box, Point x);
double signed_distance(const Solid& solid, Point x);

}  // namespace keratin::measure
