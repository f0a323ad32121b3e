// Which strands are simulated.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/motion.h"
#include "bake/stage/roots.h"
#include "bake/stage/strand_feature.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

#include <span>
#include <vector>

namespace keratin {

// Number of guides of a group with `strands` strands: the fraction, rounded, at least one.
std::size_t guide_count(std::size_t strands, double fraction);

// Chooses the guides, group by group; returns their strand numbers, ascending.
//   random    a uniform choice
//   kmeans    as many clusters of strand features as guides are wanted; of each the strand nearest
//             to its centre (Lloyd's algorithm from strands spread evenly over the groom)
//   authored  those the curve file marks. Files that mark guides are honoured too when the recipe
//             names no method.
//   motion    those of k-means, improved by a local search that lowers the measured error of the
//             other strands in `motion` (stage/motion_guides), which must be there
// Deterministic for equal input and seed, for any number of threads.
// Errors (input): authored guides are wanted and a group has none.
Result<std::vector<std::uint32_t>> choose_guides(const Groom& groom,
                                                 std::span<const StrandFeature> features,
                                                 const Roots& roots, const GroomMotion* motion,
                                                 const Recipe& recipe,
                                                 Findings& findings);

}  // namespace keratin
