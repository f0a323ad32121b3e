// Which three guides move each render strand, and by how much.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/roots.h"
#include "bake/stage/strand_feature.h"
#include "schema/read/recipe.h"

#include <array>
#include <span>
#include <vector>

namespace keratin {

struct GuideBlend {
    std::array<std::uint32_t, 3> guide{};   // strand numbers of guides, heaviest first
    std::array<double, 3> weight{1, 0, 0};  // >= 0, sum 1
};

// Two strands are on the same side of a parting when their directions at the root, taken over the
// first third, and the normals of the skin there are within 60 degrees of each other.
inline constexpr double kSameSideCosine = 0.5;

// Blends the three nearest guides (by strand feature) of the strand's own group and side of a
// parting, with weights ((R - d) / (R d))^2, d the distance of the guide and R that of the fourth
// (Franke and Little's modification of Shepard's weights): a guide's weight goes to zero before
// another takes its place, so neighbouring strands move alike. A guide follows itself alone. Blends
// authored in the curve file win where their guides are guides. Where no guide is on the strand's
// side the nearest one is taken alone.
//   guides  strand numbers, ascending
std::vector<GuideBlend> blend_guides(const Groom& groom, std::span<const StrandFeature> features,
                                     std::span<const std::uint32_t> guides, const Roots& roots,
                                     const Recipe& recipe, Findings& findings);

// Direction of a strand over its first third, unit length.
Vec3 root_direction(std::span<const Vec3> points);

}  // namespace keratin
