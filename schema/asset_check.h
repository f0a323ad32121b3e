// The meaning of an asset, checked: counts agree, every index stays inside what it points to, every
// number is finite and in its range. What passes here needs no bounds test in any kernel.
#pragma once

#include "schema/asset.h"
#include "schema/result.h"

#include <string>

namespace keratin {

// Error (input): names the field and the element ("strand_guide[17]"), its value and what would be
// right. `name` is the file. Used by the opener on what it read and by the writer on what it is
// about to write.
Result<void> check_asset(const AssetInfo& info, const AssetFields& fields, const std::string& name);

}  // namespace keratin
