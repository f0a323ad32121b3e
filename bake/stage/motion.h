// A groom in motion, every strand simulated: what guide selection by motion learns from, and what
// the interpolation error is measured against. The two are different motions, so that the error is
// that of motions not seen before.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/weights.h"

#include <span>
#include <vector>

namespace keratin {

// How far each point is from its place at rest, in the frame of its root, at some moments.
struct GroomMotion {
    std::size_t frame_count = 0;
    std::vector<float> displacement;  // [frame_count][groom points][3] m
};

// What sampled_motion() samples of each strand in each frame, at even steps of arc length.
inline constexpr int kMotionSamples = 8;

// One column a strand of `strands`: its displacements at kMotionSamples places in all frames, scaled
// so that the squared length of the difference of two columns is a mean squared distance, m^2.
Eigen::MatrixXf sampled_motion(const Groom& groom, const GroomMotion& motion,
                               std::span<const std::uint32_t> strands);

// How far the render strands end up from where they would be had they been simulated themselves:
// distances over all points and frames of the strands that are not guides, m. METHODS 1.5.
Spread reconstruction_error(const Groom& groom, const GroomMotion& motion,
                            std::span<const GuideBlend> blends);

}  // namespace keratin
