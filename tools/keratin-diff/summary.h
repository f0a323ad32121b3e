// One asset as a short text that changes only when the asset does: for git (textconv) and for
// looking at an asset by hand.
#pragma once

#include "schema/asset_view.h"

#include <string>

namespace keratin::diff {

// Counts, bounds, inputs, groups, bones and colliders, and a line a field: number of elements,
// smallest and largest value, hash of its bytes. Holds no path and no time.
std::string summary_text(const AssetView& asset);

}  // namespace keratin::diff
