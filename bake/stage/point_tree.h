// The nearest of many points.
#pragma once

#include "bake/stage/groom.h"

#include <nanoflann.hpp>

#include <cstdint>
#include <vector>

namespace keratin {

// Keeps a view of the points, of which there must be one at least and which must outlive it. Safe
// to use from many threads.
class PointTree {
  public:
    explicit PointTree(const std::vector<Vec3>& points)
        : cloud_{points}, tree_(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}
    std::uint32_t nearest(const Vec3& p) const {
        std::uint32_t index = 0;
        double squared = 0;
        tree_.knnSearch(p.data(), 1, &index, &squared);
        return index;
    }

  private:
    struct Cloud {
        const std::vector<Vec3>& points;
        std::size_t kdtree_get_point_count() const { return points.size(); }
        double kdtree_get_pt(std::size_t i, std::size_t k) const {
            return points[i][static_cast<int>(k)];
        }
        template <class Box>
        bool kdtree_get_bbox(Box&) const {
            return false;
        }
    };
    Cloud cloud_;
    nanoflann::KDTreeSingleIndexAdaptor<
        nanoflann::L2_Simple_Adaptor<double, Cloud, double, std::uint32_t>, Cloud, 3, std::uint32_t>
        tree_;
};

}  // namespace keratin
