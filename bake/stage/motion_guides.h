// Guides chosen by how well the other strands follow them in motion.
#pragma once

#include "bake/stage/motion.h"
#include "bake/stage/strand_feature.h"
#include "bake/stage/weights.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// A local search for the guides of one group that minimise the mean squared error of the strands
// interpolated from them, as measured in `motion` with the weights that the strands will get
// (stage/weights): first each guide gives its place to the follower that leads best, if any leads
// better; then each round moves guides that are missed least to where one is missed most and does
// the same again. Ends when a round gains little.
//   members  [strands of the group]  strand numbers, ascending
//   start    guides to begin with, members
// Deterministic, for any number of threads.
std::vector<std::uint32_t> improve_guides(const Groom& groom,
                                          std::span<const StrandFeature> features,
                                          const GroomMotion& motion, const SameSide& same_side,
                                          std::span<const std::uint32_t> members,
                                          std::span<const std::uint32_t> start);

// The at most three guides, of at most kGuideCandidates, and their weights with which a strand's
// motion is met best: the least squared distance in `motion` (sampled_motion) over weights >= 0 with
// sum 1. Each set of one, two and three guides is solved in closed form, and the best one wins.
//   strand, guides  columns of motion
GuideBlend fit_blend(const Eigen::MatrixXf& motion, std::uint32_t strand,
                     std::span<const std::uint32_t> guides);

}  // namespace keratin
