// The point of a triangle nearest to a given point, in double precision.
#pragma once

#include "bake/raw_groom.h"

#include <array>

namespace keratin {

// point        nearest point of the triangle
// barycentric  its weights on a, b, c: >= 0, sum 1
// distance     from the query, m
struct TrianglePoint {
    Vec3 point;
    std::array<double, 3> barycentric;
    double distance;
};

// Ericson, Real-Time Collision Detection (2004), section 5.1.5, by the regions of the triangle's
// plane. A triangle without area is taken as its three edges.
TrianglePoint nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace keratin
