#include "bake/stage/strand_feature.h"

namespace keratin {
namespace {

constexpr std::size_t kLeafSize = 12;

// Holds one neighbour and starts with a known one, so that the search begins with its distance.
class NearestOne {
  public:
    using DistanceType = double;
    using IndexType = std::uint32_t;
    using CountType = std::size_t;

    NearestOne(double distance, std::uint32_t index) : distance_(distance), index_(index) {}
    std::size_t size() const { return 1; }
    bool full() const { return true; }
    bool addPoint(double distance, std::uint32_t index) {
        if (distance < distance_) {
            distance_ = distance;
            index_ = index;
        }
        return true;
    }
    double worstDist() const { return distance_; }
    std::uint32_t index() const { return index_; }

  private:
    double distance_;
    std::uint32_t index_;
};

}  // namespace

std::vector<StrandFeature> strand_features(const Groom& groom) {
    const std::size_t n = groom.strand_count();
    std::vector<StrandFeature> out(n);
#pragma omp parallel for schedule(static)
    for (std::size_t s = 0; s < n; ++s) {
        const auto points = groom.points(s);
        const Vec3& root = points.front();
        const std::size_t last = points.size() - 1;
        const Vec3 middle = 0.5 * (points[last / 2] + points[(last + 1) / 2]) - root;
        const Vec3 tip = points[last] - root;
        for (int k = 0; k < 3; ++k) {
            const auto axis = static_cast<std::size_t>(k);
            out[s][axis] = root[k];
            out[s][axis + 3] = kShapeShare * middle[k];
            out[s][axis + 6] = kShapeShare * tip[k];
        }
    }
    return out;
}

FeatureTree::FeatureTree(std::span<const StrandFeature> features)
    : cloud_{features},
      tree_(std::make_unique<Tree>(kFeatureSize, cloud_,
                                   nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize))) {}

std::uint32_t FeatureTree::nearest(const StrandFeature& query, std::uint32_t guess) const {
    NearestOne result(squared_distance(query, cloud_.features[guess]), guess);
    tree_->findNeighbors(result, query.data(), nanoflann::SearchParams());
    return result.index();
}

std::size_t FeatureTree::nearest(const StrandFeature& query, std::span<std::uint32_t> index,
                                 std::span<double> squared) const {
    return tree_->knnSearch(query.data(), index.size(), index.data(), squared.data());
}

}  // namespace keratin
