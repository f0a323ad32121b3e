// Rest positions as 16 bits a coordinate can hold them.
#pragma once

#include "bake/report.h"
#include "bake/stage/asset_arrays.h"
#include "bake/stage/groom.h"
#include "bake/stage/order.h"
#include "schema/asset.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

namespace keratin {

// With recipe.quantise moves every point of the render strands to where it will be read back
// (schema/packed_positions.h) and asks the writer to pack them; guides stay as they are. Fills
// info's packed and packed_max_error.
// Errors (input): a point would move by more than recipe.quantise_max_error; the message names the
// strand and a bound that would do.
Result<void> quantise_positions(const Groom& groom, const AssetOrder& order, const Recipe& recipe,
                                AssetInfo& info, AssetArrays& arrays, BakeReport& report);

}  // namespace keratin
