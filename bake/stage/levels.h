// How wide strands are drawn when fewer of them are.
#pragma once

#include "bake/stage/asset_arrays.h"
#include "schema/asset.h"

#include <vector>

namespace keratin {

// A level for each halving of the render strands, down to one: what all strands cover (the sum of
// length times radius) over what that prefix covers. Needs the strand fields.
std::vector<LevelOfDetail> width_levels(const AssetArrays& arrays,
                                        std::span<const GroupInfo> groups);

}  // namespace keratin
