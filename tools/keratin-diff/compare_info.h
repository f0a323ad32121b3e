// What two assets say outside their bulk fields: the mesh they stand on, groups with their
// parameters, bones, colliders, and apart from these, where the assets came from.
#pragma once

#include "tools/keratin-diff/counterparts.h"

namespace keratin::diff {

// Fills mesh, bounds, settings, recipe, inputs and tool_version of a report whose lists and fields
// are there already: what these explain is not named again.
void compare_info(const AssetView& a, const AssetView& b, const Counterparts& counterparts,
                  Report& report);

}  // namespace keratin::diff
