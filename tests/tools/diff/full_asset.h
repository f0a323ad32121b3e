// A small valid asset that has every optional field, for tests that walk schema/fields.h.
#pragma once

#include "schema/asset_view.h"

#include <cstddef>
#include <string>
#include <vector>

namespace keratin::test {

// Owns the values of all fields, member for member.
struct FullAsset {
    AssetInfo info;
#define X(name, element, domain, components, presence, target, unit, meaning) \
    std::vector<element> name;
    KERATIN_ASSET_FIELDS(X)
#undef X

    AssetFields fields() const;
};

// Five guides of four points, seven render strands, two groups, three bones, and three of five
// triangles and five of six vertices of a mesh. Strands 5 and 6 are no guides.
FullAsset full_asset();

// An asset as the program sees it: written by bake/write, opened by the asset view. Fails the test
// with the writer's message when the asset is not valid.
class OpenAsset {
  public:
    explicit OpenAsset(const FullAsset& asset);
    const AssetView& view() const { return *view_; }

  private:
    struct alignas(32) Block {
        std::byte bytes[32];
    };
    std::vector<Block> blocks_;
    std::unique_ptr<AssetView> view_;
};

// Lays the guides out anew: guide g of the result is guide order[g] of the asset, in tiles of
// `rows` rows. One quad of tiles.
void lay_out_guides(FullAsset& asset, const std::vector<std::uint32_t>& order, std::uint32_t rows);

// Render strand s of the result is strand order[s] of the asset; strands may be left out.
void lay_out_strands(FullAsset& asset, const std::vector<std::uint32_t>& order);

}  // namespace keratin::test
