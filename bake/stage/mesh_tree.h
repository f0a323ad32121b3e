// Distances to a triangle mesh: the nearest triangle by exact point-triangle distance, and on which
// side of the surface a point lies.
#pragma once

#include "bake/raw_groom.h"
#include "bake/stage/triangle.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// The triangles of the parts whose names match one of `patterns` (`*` stands for any characters),
// ascending; all triangles when there is no pattern. A pattern that matches no part adds nothing.
std::vector<std::uint32_t> triangles_of_parts(const RawMesh& mesh,
                                              std::span<const std::string> patterns);

// True when `name` matches `pattern`, in which `*` stands for any number of characters.
bool matches(std::string_view name, std::string_view pattern);

struct NearestTriangle {
    std::uint32_t triangle = 0;  // number in the mesh
    TrianglePoint at;
};

// A search tree over some triangles of a mesh, which must live as long as the tree. Safe to use
// from many threads.
class MeshTree {
  public:
    // `triangles`: numbers in mesh.triangle, at least one.
    MeshTree(const RawMesh& mesh, std::span<const std::uint32_t> triangles);
    ~MeshTree();
    MeshTree(MeshTree&&) noexcept;
    MeshTree& operator=(MeshTree&&) noexcept;

    // The nearest triangle; among those whose distance equals the least within tie_tolerance() the
    // one with the lowest number. Exact: Eigen's KdBVH prunes by lower bounds only.
    NearestTriangle nearest(const Vec3& point) const;

    // Whether the generalised winding number of the triangles is above a half (Jacobson et al.
    // 2013). Far clusters of triangles count as dipoles (Barill et al. 2018), which is enough for
    // the side.
    bool inside(const Vec3& point) const;
    // Distance to the surface, negative inside. Where the mesh has a hole the surface goes on as
    // the skin on which the winding number is a half: it changes smoothly there, and by its value
    // and gradient the distance to the skin is known to first order. Without the skin the distance
    // would jump from one side to the other in the middle of a hole.
    double signed_distance(const Vec3& point) const;

    // Distances nearer to each other than this are equal: the rounding of coordinates of the
    // mesh's size, m.
    double tie_tolerance() const;

    const RawMesh& mesh() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

// Unit normal of a triangle; zero for one without area.
Vec3 triangle_normal(const RawMesh& mesh, std::uint32_t triangle);

}  // namespace keratin
