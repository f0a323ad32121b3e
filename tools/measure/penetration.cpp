#include "tools/measure/penetration.h"

#include <algorithm>

namespace keratin::measure {

PenetrationTracker::PenetrationTracker(const MeshDistance& mesh, std::span<const Point> rest)
    : mesh_(&mesh),
      rest_depth_(rest.size()),
      seen_(rest.begin(), rest.end()),
      distance_(rest.size()) {
    for (std::size_t p = 0; p < rest.size(); ++p) {
        distance_[p] = mesh.signed_distance(rest[p]);
        rest_depth_[p] = std::max(0.0, -distance_[p]);
    }
}

PenetrationTracker::Worst PenetrationTracker::measure(std::span<const Point> position) {
    Worst worst;
    for (std::size_t p = 0; p < position.size(); ++p) {
        if (distance(position[p], seen_[p]) >= distance_[p]) {
            distance_[p] = mesh_->signed_distance(position[p]);
            seen_[p] = position[p];
        }
        const double deeper = distance(position[p], seen_[p]) > 0
                                  ? 0  // not measured anew: still outside
                                  : -distance_[p] - rest_depth_[p];
        if (deeper > worst.deeper) worst = {deeper, p};
    }
    return worst;
}

}  // namespace keratin::measure
