#include "bake/stage/levels.h"

#include <cmath>
#include <numeric>

namespace keratin {

std::vector<LevelOfDetail> width_levels(const AssetArrays& arrays,
                                        std::span<const GroupInfo> groups) {
    const std::size_t n = arrays.strand_id.size();
    // covered[s]: by the first s strands, m^2.
    std::vector<double> covered(n + 1, 0);
#pragma omp parallel for schedule(static)
    for (std::size_t s = 0; s < n; ++s) {
        double length = 0;
        for (std::size_t p = arrays.strand_first_point[s] + 1; p < arrays.strand_first_point[s + 1];
             ++p) {
            double squared = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double d = double{arrays.strand_position[3 * p + k]} -
                                 double{arrays.strand_position[3 * p + k - 3]};
                squared += d * d;
            }
            length += std::sqrt(squared);
        }
        const double radius = arrays.strand_radius.empty()
                                  ? groups[arrays.strand_group[s]].material.radius
                                  : arrays.strand_radius[s];
        covered[s + 1] = length * radius;
    }
    std::partial_sum(covered.begin(), covered.end(), covered.begin());
    std::vector<LevelOfDetail> out;
    for (std::size_t count = n / 2; count > 0; count /= 2) {
        out.push_back({static_cast<std::uint32_t>(count),
                       static_cast<float>(covered[n] / covered[count])});
    }
    return out;
}

}  // namespace keratin
