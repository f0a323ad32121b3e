// The rest state as the asset stores it: everything so far, in its final order and as floats.
#pragma once

#include "bake/report.h"
#include "bake/stage/asset_arrays.h"
#include "bake/stage/bones.h"
#include "bake/stage/groom.h"
#include "bake/stage/order.h"
#include "bake/stage/roots.h"
#include "bake/stage/weights.h"
#include "schema/asset.h"
#include "schema/read/recipe.h"

#include <span>

namespace keratin {

// Material and solver parameters of each group of the groom, from the recipe. Groups of the recipe
// without strands are reported.
std::vector<GroupInfo> group_settings(const Groom& groom, const Recipe& recipe, Findings& findings);

// Fills all fields of strands and guides. Lengths and shapes are measured on the positions as
// rounded to float, so that the stored rest state is in equilibrium with itself.
//   blends [strand_count], by old strand number
void store_strands(const Groom& groom, const Roots& roots, const Carriers& carriers,
                   const AssetOrder& order, std::span<const GuideBlend> blends,
                   std::span<const GroupInfo> groups, AssetArrays& out);

// Fills the mesh fields with what the recipe keeps: nothing, the triangles that carry roots, or
// everything; and info's counts and topology hash. `mesh` may be null.
void store_mesh(const RawMesh* mesh, const Roots& roots, const Recipe& recipe, AssetInfo& info,
                AssetArrays& out);

// Hash of the triangles' vertex numbers as read: equal for meshes that can carry each other's
// roots.
Hash128 topology_hash(const RawMesh& mesh);

}  // namespace keratin
