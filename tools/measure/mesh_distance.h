// Signed distance to a triangle mesh, negative inside, also for meshes with holes (a head that is
// open at the neck). What is inside is decided by the generalised winding number (Jacobson et al.
// 2013), far triangles gathered into dipoles (Barill et al. 2018); the distance is exact.
#pragma once

#include "tools/measure/point.h"

#include <array>
#include <vector>

namespace keratin::measure {

class MeshDistance {
  public:
    // Copies the mesh. Triangles without area are left out; indices are below vertices.size().
    // Which way the triangles face does not matter as long as they agree.
    MeshDistance(std::span<const Point> vertices,
                 std::span<const std::array<std::uint32_t, 3>> triangles);

    bool empty() const { return corners_.empty(); }
    // To the nearest point of the surface, m; infinite for an empty mesh.
    double unsigned_distance(Point x) const;
    // About 1 inside a closed mesh, 0 outside; in between near a hole.
    double winding_number(Point x) const;
    double signed_distance(Point x) const;

  private:
    struct Node {
        Point low, high;     // bounds
        Point center, area;  // of the triangles below: mean by area, sum of area vectors
        double radius = 0;   // from center to the farthest corner
        std::uint32_t first = 0, count = 0;  // triangles, when a leaf
        std::uint32_t child = 0;             // the first of two, when not
    };
    void build(std::uint32_t node, std::uint32_t first, std::uint32_t count);

    std::vector<std::array<Point, 3>> corners_;
    std::vector<Node> nodes_;
    double facing_ = 1;  // -1 when the triangles face inwards
};

// The nearest point of a triangle (Ericson 2004, 5.1.5).
Point nearest_on_triangle(Point x, const std::array<Point, 3>& corners);

// Solid angle of a triangle seen from x over 4 pi (van Oosterom & Strackee 1983).
double winding_of_triangle(Point x, const std::array<Point, 3>& corners);

}  // namespace keratin::measure
