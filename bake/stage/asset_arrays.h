// The bulk fields of an asset as vectors, before they are written.
#pragma once

#include "schema/fields.h"

#include <cstdint>
#include <vector>

namespace keratin {

struct AssetArrays {
#define X(name, element, domain, components, presence, target, unit, meaning) \
    std::vector<element> name;
    KERATIN_ASSET_FIELDS(X)
#undef X

    AssetFields fields() const {
        AssetFields out;
#define X(name, element, domain, components, presence, target, unit, meaning) out.name = name;
        KERATIN_ASSET_FIELDS(X)
#undef X
        return out;
    }
};

}  // namespace keratin
