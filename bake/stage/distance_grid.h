// Signed distances to the mesh on a sparse grid, an exact collider for bodies that move rigidly.
#pragma once

#include "bake/report.h"
#include "bake/stage/bones.h"
#include "bake/stage/groom.h"
#include "schema/asset.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

#include <cstdint>
#include <vector>

namespace keratin {

struct BakedDistanceGrid {
    DistanceGridInfo info;
    std::vector<std::uint32_t> brick;  // [bricks], asset field grid_brick
    std::vector<float> distance;       // [stored bricks * 125] m, asset field grid_distance
    BakeReport::DistanceGrid measured;
};

// Covers the part of the mesh that hair can reach (within a strand's length of its root) with
// bricks of 4^3 cells. A brick is stored when some of it lies within a cell's diagonal of the
// surface or inside the mesh; elsewhere there is nothing to collide with. Inside and outside are
// told apart by the winding number, so holes in the mesh (a neck, eyes) do no harm: over them
// a skin where that number is one half closes the mesh, and hair keeps off it too. Distances are
// MeshTree's at the nodes, but lowered where the linear interpolation would leave the mesh standing out (rims,
// sheets thinner than a cell). Its error is measured at the mesh's vertices and at the middle of
// every stored cell that the surface crosses. With recipe.distance_grid_margin the stored distances
// are smaller by it, so that hair keeps off the mesh by more than the grid's error.
// Errors (input): the grid would have more than 2^24 bricks; the message says which spacing would do.
Result<BakedDistanceGrid> make_distance_grid(const RawMesh& mesh, const Groom& groom,
                                             const Carriers& carriers, const Recipe& recipe);

// Linear interpolation in a cell of a stored brick; `at` in cells from the brick's first node,
// 0..kBrickCells on each axis.
double interpolate_brick(const float* nodes, const Vec3& at);

}  // namespace keratin
