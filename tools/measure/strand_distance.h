// How far strands overlap each other and solids: the judge of contact handling. Shares no code with
// runtime/contact: another segment distance, another search.
#pragma once

#include "tools/measure/point.h"
#include "tools/measure/solid.h"

#include <span>

namespace keratin::measure {

// Distance of the segments a0 a1 and b0 b1, m.
double segment_distance(Point a0, Point a1, Point b0, Point b1);

struct Overlap {
    double depth = 0;       // m: largest delta - distance, 0 where nothing overlaps
    double share = 0;       // largest depth / delta
    std::size_t pairs = 0;  // pairs of edges (or edges, against a solid) nearer than delta
    std::size_t first = 0, second = 0;  // edges of the deepest pair, counted over all strands
};

// All pairs of edges of all strands, neighbours on a strand and edges with less than 1.6 delta of
// strand between them left out. tolerance: pairs count from this share of delta on; depth and share
// do not depend on it.
//   radius [strands] m; contact_distance: m, 0: delta = r1 + r2
Overlap overlap_between(const Strands& strands, std::span<const double> radius,
                        double contact_distance, double tolerance);

// Each edge as a segment against a convex solid. contact_distance: m, 0: the strand's radius. skip:
// the first edges of each strand, held by a clamp.
Overlap overlap_with(const Strands& strands, std::span<const double> radius, const Solid& solid,
                     double contact_distance, double tolerance, std::size_t skip);

}  // namespace keratin::measure
