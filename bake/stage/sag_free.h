// A rest shape that gravity pulls into the groomed one: hair of the strand solver starts in
// equilibrium instead of sagging off its groom (METHODS 1.4, Beyond).
#pragma once

#include "bake/report.h"
#include "bake/stage/asset_arrays.h"
#include "schema/asset.h"
#include "schema/read/recipe.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// Whether the recipe asks for it, for each group of the asset.
std::vector<std::uint8_t> sag_free_groups(std::span<const GroupInfo> groups, const Recipe& recipe);

// Replaces the rest edges in `arrays.guide_shape` of the guides in the `chosen` groups by those
// with which the moments of the solver's local shape (schema/bend.h) carry the weight in the
// groomed pose, gravity 9.81 m/s^2 along -y; lengths stay. A pose that no rest shape holds, or
// holds only until it is nudged, gets the rest shape with which it settles nearest to the groom,
// and is named in the findings.
//   groups  of the asset
//   chosen  [groups]
// Not taken into account: what bears hair besides its own stiffness (colliders, the grid's volume).
BakeReport::SagFree make_sag_free(std::span<const GroupInfo> groups,
                                  std::span<const std::uint8_t> chosen, AssetArrays& arrays,
                                  Findings& findings);

}  // namespace keratin
