#include "bake/write.h"
#include "tests/tools/diff/full_asset.h"

#include <catch2/catch.hpp>

#include <algorithm>

namespace keratin::test {

OpenAsset::OpenAsset(const FullAsset& asset) {
    const auto bytes = serialise_asset(asset.info, asset.fields(), "test.kera");
    if (!bytes) FAIL(to_string(bytes.error()));
    blocks_.resize(bytes->size() / sizeof(Block) + 1);
    auto* begin = reinterpret_cast<std::byte*>(blocks_.data());
    std::copy(bytes->begin(), bytes->end(), begin);
    auto view = AssetView::from_memory({begin, bytes->size()}, "test.kera");
    if (!view) FAIL(to_string(view.error()));
    view_ = std::make_unique<AssetView>(std::move(*view));
}

}  // namespace keratin::test
