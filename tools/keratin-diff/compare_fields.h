// One field of two assets, item by item between counterparts.
#pragma once

#include "tools/keratin-diff/counterparts.h"

#include <vector>

namespace keratin::diff {

// All fields of schema/fields.h, in that order.
std::vector<FieldDifference> compare_fields(const AssetView& a, const AssetView& b,
                                            const Counterparts& counterparts);

}  // namespace keratin::diff
