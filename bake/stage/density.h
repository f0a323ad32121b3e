// How dense the groom is at rest at each guide point, for volume preservation.
#pragma once

#include "bake/stage/asset_arrays.h"
#include "schema/asset.h"

namespace keratin {

// Fills guide_density (kg/m^3) when some group preserves volume (volume > 0); does nothing
// otherwise. The solver divides by it, so it is measured the solver's way (METHODS 1.2, 1.3): the
// mass of every simulated point (from the third on: half the lengths of the segments on both sides
// times the line density, times the number of render strands a guide stands for) is spread
// trilinearly over voxels of a lattice through the origin, 32 along the groom's longest side, and
// read back trilinearly at the points. Needs info's counts, groups and bounds and the guide fields.
void store_density(const AssetInfo& info, AssetArrays& out);

}  // namespace keratin
