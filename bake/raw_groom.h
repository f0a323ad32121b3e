// Curves and meshes as read from files: double precision, plain vectors, still in the files' own
// units and axes. What the readers in bake/read produce and the stages consume.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace keratin {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;

// One strand or curve in file order: a polyline, or a NURBS curve when degree > 0.
// A NURBS curve has n control points, n weights (> 0) and n + degree + 1 knots, already validated
// by bake/nurbs.h; a polyline has no weights and no knots.
struct RawCurve {
    std::vector<Vec3> points;
    int degree = 0;
    std::vector<double> weights;
    std::vector<double> knots;
    double u_begin = 0, u_end = 0;  // the part of the parameter range that the file asks for
    std::string name;               // of the curve in its file, if it has one
    int line = 0;                   // where it starts in a text file, 0 otherwise
};

// One file of curves. Per-curve channels are empty or have one entry a curve.
struct RawGroom {
    std::string file;                     // as the recipe names it
    std::vector<RawCurve> curves;
    std::vector<Vec2> root_uv;            // texture coordinate at the root
    std::vector<double> radius;           // at the root, in the file's unit
    std::vector<std::vector<double>> point_radius;  // per point, in the file's unit
    std::vector<std::uint32_t> id;        // authored ids
    std::vector<std::uint32_t> group;     // index into group_names
    std::vector<std::string> group_names;
    std::vector<std::uint8_t> is_guide;   // authored guides
    // Authored interpolation: ids of three guides and their weights a curve.
    std::vector<std::array<std::uint32_t, 3>> closest_guides;
    std::vector<std::array<double, 3>> guide_weights;
    // Points that the file marks as carried, not simulated, counted from the root (.tfx v4: w = 0).
    std::vector<std::uint32_t> fixed_points;
    std::optional<double> metres_per_unit;  // when the file says so (IGES)
};

// Bones of a .tfxbone file or of a mesh's skin: four weights a strand or vertex, not yet normalised.
struct RawSkin {
    std::vector<std::string> bones;
    std::vector<std::array<std::uint32_t, 4>> bone;
    std::vector<std::array<double, 4>> weight;
};

struct RawMeshPart {
    std::string name;
    std::uint32_t first_triangle = 0, triangle_count = 0;
};

struct RawMesh {
    std::string file;
    std::vector<Vec3> position;                          // finite
    std::vector<Vec2> uv;                                // empty or one a vertex
    std::vector<std::array<std::uint32_t, 3>> triangle;  // indices < position.size()
    std::vector<RawMeshPart> parts;                      // in triangle order, covering all
    std::optional<RawSkin> skin;                         // one entry a vertex
};

}  // namespace keratin
