// The order of things in the asset: guides in tiles, render strands in a list of which every prefix
// is a fair sample.
#pragma once

#include "bake/stage/groom.h"
#include "schema/layout.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

struct AssetOrder {
    std::vector<std::uint32_t> strand;          // [strand_count] old number of each render strand
    std::vector<std::uint32_t> new_strand;      // [strand_count] its inverse
    std::vector<std::uint32_t> lane_strand;     // [tiles * 16] old strand number, kNoStrand: empty
    std::vector<std::uint32_t> lane_group;      // [tiles * 16]
    std::vector<std::uint32_t> tile_first_row;  // [tiles + 1]
    std::vector<std::uint32_t> lane_of;         // [strand_count] lane of a guide, kNoStrand
};

// Guides: by group, then point count (longest first), then along a space-filling curve through the
// roots; filled into quads of four tiles of 16 (schema/layout.h), one group a quad, all four tiles
// with the rows of the quad's longest guide. Render strands: sorted by group and space, then
// taken in an order of which every prefix is spread evenly over the groom (stage/spatial_order),
// so that a level of detail is a prefix.
//   guides  strand numbers, ascending
AssetOrder order_asset(const Groom& groom, std::span<const std::uint32_t> guides);

}  // namespace keratin
