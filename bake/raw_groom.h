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

// The largest coordinate that a file may hold, in its own unit: beyond it single precision
// overflows in the square of a length.
constexpr double kLargestCoordinate = 1e15;

// Whether every coordinate is finite and of a usable size.
inline bool is_usable(const Vec3& position) {
    return position.allFinite() && position.cwiseAbs().maxCoeff() <= kLargestCoordinate;
}

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
    std::size_t index = 0;          // its number in the file from 0, unusable curves counted too
};

// A curve that a reader left out because nothing can be made of it, in a file that is otherwise
// sound: too few points or knots, unsorted knots, a weight <= 0, a position that is not finite.
struct CurveProblem {
    std::size_t curve = 0;  // its number in the file from 0 (RawCurve::index of the others)
    int line = 0;           // in a text file, 0 otherwise
    std::string what;       // "knots decrease at knot 4 (0.5 after 0.7)"
};

// One file of curves. Per-curve channels are empty or have one entry a curve.
struct RawGroom {
    std::string file;  // as the recipe names it
    std::vector<RawCurve> curves;
    std::vector<CurveProblem> problems;             // the curves left out, in file order
    std::vector<std::string> remarks;               // what the file says that could not be used
    std::vector<std::string> dependencies;          // further files that were read, for build tools
    std::vector<Vec2> root_uv;                      // texture coordinate at the root
    std::vector<double> radius;                     // at the root, in the file's unit
    std::vector<std::vector<double>> point_radius;  // per point, in the file's unit
    std::vector<std::uint32_t> id;                  // authored ids
    std::vector<std::uint32_t> group;               // index into group_names
    std::vector<std::string> group_names;
    std::vector<std::uint8_t> is_guide;  // authored guides
    // Authored interpolation: ids of three guides and their weights a curve.
    std::vector<std::array<std::uint32_t, 3>> closest_guides;
    std::vector<std::array<double, 3>> guide_weights;
    // Points that the file marks as carried, not simulated, counted from the root (.tfx v4: w = 0).
    std::vector<std::uint32_t> fixed_points;
    std::optional<double> metres_per_unit;  // when the file says so (IGES)
};

// Bones of a .tfxbone file or of a mesh's skin: four weights a strand or vertex, not yet
// normalised.
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
    // Further files that the mesh stands on (buffers, material libraries), for build tools.
    std::vector<std::string> dependencies;
};

// Roots bound to triangles by the tool that made the groom (.tfxskin). One entry a strand each.
// Such bindings may not fit the mesh that comes along: check them before use.
struct RawBinding {
    std::uint32_t mesh_triangle_count = 0;  // of the mesh they were made for
    std::vector<std::uint32_t> mesh;        // which mesh of the model
    std::vector<std::uint32_t> triangle;    // < mesh_triangle_count
    std::vector<std::array<double, 3>> barycentric;
    std::vector<std::array<double, 3>> uvw;  // empty, or one a strand
};

}  // namespace keratin
