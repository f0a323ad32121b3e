// Where each strand sits on the mesh.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/mesh_tree.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

#include <map>
#include <optional>
#include <span>
#include <vector>

namespace keratin {

// The mesh parts that the curve files grow on, one search tree for each different choice of parts.
struct GrowthSurfaces {
    std::vector<MeshTree> trees;
    std::vector<const MeshTree*> of_source;  // [curve files]; null without a mesh
    std::vector<std::uint32_t> triangles;    // of all choices together, ascending
};

// `mesh` may be null and must outlive the result.
// Errors (input): `mesh_nodes` of a file match no part (the message lists the parts), or without
// a mesh; the matching parts hold no triangles with area.
Result<GrowthSurfaces> find_growth_surfaces(const Recipe& recipe, const RawMesh* mesh,
                                            Findings& findings);

// Arrays are empty without a mesh.
struct Roots {
    std::vector<std::uint32_t> triangle;  // [strand_count] number in the mesh
    std::vector<Vec2> barycentric;        // [strand_count] (u, v), schema/formula/barycentric.h
    std::vector<double> distance;         // [strand_count] m, root to its triangle
    std::vector<Vec3> normal;             // [strand_count] unit, of the triangle
    std::vector<Vec2> uv;                 // [strand_count] texture coordinate; empty: none known
};

// Binds each root to the nearest triangle of the parts its file grows on: exact distances in
// double; of triangles at the same distance the one with the lowest number. The texture coordinate
// is the file's own where it has one, the mesh's otherwise.
Roots bind_roots(const Groom& groom, const GrowthSurfaces& surfaces, const Recipe& recipe,
                 Findings& findings);

}  // namespace keratin
