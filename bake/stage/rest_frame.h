// Rest lengths and rest shape of one strand, in the conventions of schema/formula/frame.h.
#pragma once

#include <span>

namespace keratin {

// points  [count * 3]  m, root first, no two neighbours equal; the numbers as they will be stored
// normal  [3]          of the skin at the root; any vector where none is known
// lengths [count] out  m, of the segment that ends at each point; 0 at the root
// shapes  [count * 3] out  at the root the director u of the root frame: perpendicular to the first
//                      edge, as near to the normal as can be. At every other point the edge that
//                      ends there, in the frame of the edge before it (the first edge: in its own),
//                      frames carried by minimal rotations. METHODS 1.4.
void rest_frames(std::span<const double> points, std::span<const double, 3> normal,
                 std::span<double> lengths, std::span<double> shapes);

}  // namespace keratin
