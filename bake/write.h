// The only writer of assets.
#pragma once

#include "schema/asset.h"
#include "schema/result.h"

#include <cstddef>
#include <string>
#include <vector>

namespace keratin {

// The bytes of the asset that info and fields describe; equal input gives equal bytes. format_*,
// file_hash and file_size of info are set here, whatever they hold. Error (input): as check_asset,
// or the asset would exceed 2 GiB.
Result<std::vector<std::byte>> serialise_asset(const AssetInfo& info, const AssetFields& fields,
                                               const std::string& name);

}  // namespace keratin
