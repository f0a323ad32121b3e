// A small valid asset for tests: five straight guides of four points, seven render strands.
#pragma once

#include "schema/asset.h"

#include <vector>

namespace keratin::test {

// Owns the values that fields() points to; change them to make an asset wrong on purpose.
struct SmallAsset {
    AssetInfo info;
    std::vector<std::uint32_t> tile_first_row, guide_point_count, guide_strand, guide_group,
        guide_triangle, strand_first_point, strand_guide, strand_id, strand_group, strand_triangle,
        mesh_triangle;
    std::vector<float> guide_position, guide_length, guide_shape, guide_barycentric,
        strand_position, strand_weight, strand_barycentric, strand_uv, mesh_position;

    AssetFields fields() const;
};

SmallAsset small_asset();

}  // namespace keratin::test
