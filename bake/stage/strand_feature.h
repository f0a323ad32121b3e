// A strand as a point of nine dimensions, near to the points of strands with a near root and a
// similar shape. What guide selection and interpolation search in.
#pragma once

#include "bake/stage/groom.h"

#include <nanoflann.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace keratin {

// Root, and the offsets root -> middle and root -> tip times kShapeShare, all in m. So two strands
// with a common root and tips 10 cm apart are as far from each other as parallel strands 3 cm
// apart.
inline constexpr double kShapeShare = 0.3;
inline constexpr int kFeatureSize = 9;
using StrandFeature = std::array<double, kFeatureSize>;

// [strand_count]; the groom has been resampled to even steps of arc length.
std::vector<StrandFeature> strand_features(const Groom& groom);

inline double squared_distance(const StrandFeature& a, const StrandFeature& b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

// A nanoflann tree over features, which must outlive it. Safe to use from many threads.
class FeatureTree {
  public:
    explicit FeatureTree(std::span<const StrandFeature> features);

    // The nearest feature. `guess` is any feature's number; a near one makes the search fast.
    std::uint32_t nearest(const StrandFeature& query, std::uint32_t guess) const;

    // The `count` nearest, nearest first (fewer when the tree holds fewer), and the squared
    // distances.
    std::size_t nearest(const StrandFeature& query, std::span<std::uint32_t> index,
                        std::span<double> squared) const;

  private:
    struct Cloud {
        std::span<const StrandFeature> features;
        std::size_t kdtree_get_point_count() const { return features.size(); }
        double kdtree_get_pt(std::size_t i, std::size_t k) const { return features[i][k]; }
        template <class Box>
        bool kdtree_get_bbox(Box&) const {
            return false;
        }
    };
    using Tree = nanoflann::KDTreeSingleIndexAdaptor<
        nanoflann::L2_Simple_Adaptor<double, Cloud, double, std::uint32_t>, Cloud, kFeatureSize,
        std::uint32_t>;

    Cloud cloud_;
    std::unique_ptr<Tree> tree_;
};

}  // namespace keratin
