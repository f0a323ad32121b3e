// How deep points get into a body during a run, beyond what the groom itself had at rest.
#pragma once

#include "tools/measure/mesh_distance.h"

namespace keratin::measure {

// Follows points through a run against a mesh that stands still in its own space. A point that was
// d outside and has moved by less than d since is still outside and costs nothing.
class PenetrationTracker {
  public:
    // rest [points]: where depths that the groom has anyway are measured, in the mesh's space.
    PenetrationTracker(const MeshDistance& mesh, std::span<const Point> rest);

    // Depth (m) of each point at rest, 0 outside.
    std::span<const double> rest_depth() const { return rest_depth_; }

    struct Worst {
        double deeper = 0;  // m beyond max(0, depth at rest); 0: no point is
        std::size_t point = 0;
    };
    // The point that is deepest beyond its depth at rest, at positions in the mesh's space.
    Worst measure(std::span<const Point> position);

  private:
    const MeshDistance* mesh_;
    std::vector<double> rest_depth_;
    std::vector<Point> seen_;       // where the point was measured last
    std::vector<double> distance_;  // what was found there
};

}  // namespace keratin::measure
