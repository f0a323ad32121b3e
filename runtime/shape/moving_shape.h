// Rigid shapes that hair meets: plane, sphere, capsule, box and triangle mesh, each in a frame of
// its own that moves from one pose to another within a step. Double precision: for rods and
// contact.
#pragma once

#include "runtime/shape/vector3.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// Rotation matrix by columns and translation: x -> axis_x x.x + axis_y x.y + axis_z x.z + origin.
struct RigidPose {
    Vector3 axis_x{1, 0, 0}, axis_y{0, 1, 0}, axis_z{0, 0, 1};
    Vector3 origin{0, 0, 0};  // m
};

inline Vector3 rotate(const RigidPose& pose, const Vector3& v) {
    return v.x * pose.axis_x + v.y * pose.axis_y + v.z * pose.axis_z;
}
inline Vector3 to_world(const RigidPose& pose, const Vector3& x) {
    return rotate(pose, x) + pose.origin;
}
inline Vector3 to_local(const RigidPose& pose, const Vector3& x) {
    const Vector3 w = x - pose.origin;
    return {dot(pose.axis_x, w), dot(pose.axis_y, w), dot(pose.axis_z, w)};
}

// The pose of the rotation by the unit quaternion (x, y, z, w) followed by the translation.
inline RigidPose make_pose(double qx, double qy, double qz, double qw, const Vector3& translation) {
    return {{1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qz * qw), 2 * (qx * qz - qy * qw)},
            {2 * (qx * qy - qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + qx * qw)},
            {2 * (qx * qz + qy * qw), 2 * (qy * qz - qx * qw), 1 - 2 * (qx * qx + qy * qy)},
            translation};
}

enum class ShapeKind : std::uint8_t { plane, sphere, capsule, box, mesh };

// Triangles of a mesh with a tree of boxes over them. Built once; both sides of a triangle count.
class TriangleTree {
  public:
    // points [point_count], m; triangles [3 * triangle_count], indices of points, in range.
    TriangleTree(std::span<const Vector3> points, std::span<const std::uint32_t> triangles);

    std::span<const Vector3> points() const { return points_; }
    std::span<const std::uint32_t> triangles() const { return triangles_; }
    // A mesh edge and the two triangles beside it: their corners that are not on the edge. A border
    // edge names its one corner twice.
    struct Edge {
        std::uint32_t point[2], corner[2];
    };
    // Each edge of the mesh belongs to exactly one triangle; these are the triangle's own.
    std::span<const Edge> edges_of(std::uint32_t triangle) const {
        return {edges_.data() + edge_start_[triangle],
                edge_start_[triangle + 1] - edge_start_[triangle]};
    }
    std::uint32_t edge_index(const Edge& edge) const {
        return static_cast<std::uint32_t>(&edge - edges_.data());
    }

    // Calls visit(triangle) for each triangle whose box overlaps the box low..high, in tree order.
    template <class Visit>
    void overlapping(const Vector3& low, const Vector3& high, Visit&& visit) const {
        std::uint32_t stack[64];
        int depth = 0;
        if (!nodes_.empty()) stack[depth++] = 0;
        while (depth > 0) {
            const Node& node = nodes_[stack[--depth]];
            if (node.low.x > high.x || node.low.y > high.y || node.low.z > high.z ||
                node.high.x < low.x || node.high.y < low.y || node.high.z < low.z)
                continue;
            if (node.count > 0) {
                for (std::uint32_t i = 0; i < node.count; ++i) visit(order_[node.first + i]);
            } else {
                stack[depth++] = node.first + 1;
                stack[depth++] = node.first;
            }
        }
    }

  private:
    struct Node {
        Vector3 low, high;
        std::uint32_t first;  // first child (the second follows it), or first triangle in order_
        std::uint32_t count;  // triangles of a leaf; 0: an inner node
    };

    std::vector<Vector3> points_;
    std::vector<std::uint32_t> triangles_, order_;
    std::vector<std::uint32_t> edge_start_;
    std::vector<Edge> edges_;
    std::vector<Node> nodes_;
};

// A shape in its own frame.
//   plane    the half space below: point a, unit outward normal b
//   sphere   centre a, radius
//   capsule  axis a..b, radius (the surface; a long one serves as a cylinder or pipe)
//   box      centre a, half edge lengths b
//   mesh     the surface, both sides
struct RigidShape {
    ShapeKind kind = ShapeKind::plane;
    Vector3 a{0, 0, 0}, b{0, 1, 0};
    double radius = 0;
    const TriangleTree* mesh = nullptr;  // owned by the caller, alive as long as the shape is used
};

// A shape on its way through a step: poses at its start and end; material points move linearly
// between them.
struct MovingShape {
    RigidShape shape;
    RigidPose pose_t0, pose_t1;
    double friction = 0.3;
    double contact_distance = 0;  // m from the surface; 0: the strand's radius
};

// The point of the surface that is closest to p, both in the shape's frame.
struct SurfacePoint {
    Vector3 point;
    Vector3 normal;   // unit, outward; of a mesh: towards p
    double distance;  // m; negative inside; of a mesh never negative
};

SurfacePoint closest_on_shape(const RigidShape& shape, const Vector3& p);

}  // namespace keratin
