#include "bake/stage/motion.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

// Displacement of strand s in a frame at a fraction of its arc length; points stand evenly.
Eigen::Vector3f displacement_at(const Groom& groom, const GroomMotion& motion, std::size_t frame,
                                std::size_t s, double fraction) {
    const std::size_t last = groom.point_count(s) - 1;
    const double place = fraction * static_cast<double>(last);
    const std::size_t p = std::min(static_cast<std::size_t>(place), last - 1);
    const auto t = static_cast<float>(place - static_cast<double>(p));
    const float* x =
        motion.displacement.data() + 3 * (frame * groom.position.size() + groom.first_point[s] + p);
    const Eigen::Vector3f a(x[0], x[1], x[2]), b(x[3], x[4], x[5]);
    return a + t * (b - a);
}

double fraction_of(std::size_t p, std::size_t count) {
    return static_cast<double>(p) / static_cast<double>(count - 1);
}

}  // namespace

Eigen::MatrixXf sampled_motion(const Groom& groom, const GroomMotion& motion,
                               std::span<const std::uint32_t> strands) {
    Eigen::MatrixXf out(static_cast<Eigen::Index>(motion.frame_count) * kMotionSamples * 3,
                        static_cast<Eigen::Index>(strands.size()));
    const float scale =
        1 / std::sqrt(static_cast<float>(std::max<std::size_t>(1, motion.frame_count)) *
                      static_cast<float>(kMotionSamples));
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < strands.size(); ++i) {
        Eigen::Index row = 0;
        for (std::size_t f = 0; f < motion.frame_count; ++f) {
            for (int k = 1; k <= kMotionSamples; ++k, row += 3) {
                out.col(static_cast<Eigen::Index>(i)).segment<3>(row) =
                    scale * displacement_at(groom, motion, f, strands[i],
                                            static_cast<double>(k) / kMotionSamples);
            }
        }
    }
    return out;
}

Spread reconstruction_error(const Groom& groom, const GroomMotion& motion,
                            std::span<const GuideBlend> blends) {
    std::vector<std::uint32_t> strands;
    std::vector<std::size_t> first;
    std::size_t values = 0;
    for (std::uint32_t s = 0; s < groom.strand_count(); ++s) {
        if (blends[s].guide[0] == s) continue;
        strands.push_back(s);
        first.push_back(values);
        values += motion.frame_count * groom.point_count(s);
    }
    std::vector<double> error(values);
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < strands.size(); ++i) {
        const std::uint32_t s = strands[i];
        const std::size_t count = groom.point_count(s);
        std::size_t at = first[i];
        for (std::size_t f = 0; f < motion.frame_count; ++f) {
            for (std::size_t p = 0; p < count; ++p) {
                const double fraction = fraction_of(p, count);
                Eigen::Vector3f d = displacement_at(groom, motion, f, s, fraction);
                for (std::size_t k = 0; k < 3; ++k) {
                    d -= static_cast<float>(blends[s].weight[k]) *
                         displacement_at(groom, motion, f, blends[s].guide[k], fraction);
                }
                error[at++] = d.norm();
            }
        }
    }
    return spread_of(std::move(error));
}

}  // namespace keratin
