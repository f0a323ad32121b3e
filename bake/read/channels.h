// Per-strand values of files whose parts need not all carry the same ones.
#pragma once

#include "bake/raw_groom.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace keratin {

struct StrandChannels {
    std::optional<Vec2> root_uv;
    std::optional<double> radius;
    std::vector<double> point_radius;  // empty: not given
    std::optional<std::uint32_t> id;
    std::optional<bool> is_guide;
    std::optional<std::array<std::uint32_t, 3>> closest_guides;
    std::optional<std::array<double, 3>> guide_weights;
};

// Puts those channels into the groom that every strand has. One entry a curve of the groom.
void attach_channels(RawGroom& groom, const std::vector<StrandChannels>& strands);

}  // namespace keratin
