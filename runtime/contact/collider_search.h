// The contacts of strands with one collider (METHODS 2.5, 2.8): round solids along the whole edge,
// boxes and meshes by vertices, faces and edges.
#pragma once

#include "runtime/contact/detection.h"

#include <cstdint>
#include <vector>

namespace keratin {

// Adds the contacts of one edge with one collider, whose index keys them. again: not the first
// search of the step, whose motion knows of no contact.
void find_on_collider(const ContactStrands& strands, const DetectionSettings& settings,
                      const MovingShape& collider, std::uint32_t index, bool again,
                      std::uint32_t edge, std::vector<FoundContact>& out);

}  // namespace keratin
