// Two grooms over each other, as a picture: where strands differ, and by how much.
#pragma once

#include "schema/asset_view.h"
#include "tools/keratin-view/image.h"
#include "tools/keratin-view/render.h"
#include "tools/keratin-view/subject.h"

namespace keratin::view {

struct DifferenceOptions {
    RenderSettings render;
    ViewAngles angles;
    // m; distance with the brightest colour. 0: the largest there is.
    float full = 0;
};

struct DifferenceImage {
    Image image;
    float largest = 0;                   // m, over points of strands that both have
    std::size_t only_a = 0, only_b = 0;  // strands
};

// Strands are matched by their ids. Those of both are drawn where `b` has them: grey where they are
// at the same place, from dark blue over green to yellow by the distance between the same shares of
// their length. Strands that only `a` has are red, those that only `b` has are magenta. A legend
// says the numbers. Errors: those of render.
Result<DifferenceImage> draw_difference(const Subject& a, const Subject& b,
                                        const DifferenceOptions& options = {});
// Two assets in their rest poses.
Result<DifferenceImage> draw_difference(const AssetView& a, const AssetView& b,
                                        const DifferenceOptions& options = {});

}  // namespace keratin::view
