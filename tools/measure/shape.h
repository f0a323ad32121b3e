// How far strands are from a shape they should have: their rest lengths, their pose in the groom,
// another run.
#pragma once

#include "tools/measure/point.h"

namespace keratin::measure {

// How one number over many points spreads.
struct Spread {
    double max = 0, mean = 0;
};

// | |e| / |e_rest| - 1 | over all segments of a strand whose rest length is above 0.
//   rest.position [points] m; the same strands at rest
Spread stretch(const Strands& strands, const Strands& rest);

// Distance (m) of each tip from where it would be if the groom moved rigidly with its root.
//   rigid.position [points] m; the rest shape carried by the body
Spread tip_lag(const Strands& strands, const Strands& rigid);

// Distance (m) between corresponding points: from the groomed pose when b is the rigidly carried
// groom, of interpolated from simulated strands, of one run from another. Sizes are equal.
Spread point_distance(std::span<const Point> a, std::span<const Point> b);

}  // namespace keratin::measure
