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

struct GroomMotion;

struct GuideBlend {
    std::array<std::uint32_t, 3> guide{};   // strand numbers of guides, heaviest first
    std::array<double, 3> weight{1, 0, 0};  // >= 0, sum 1
};

// Guides looked at: enough that three of them are on the right side of a parting through the middle
// of the neighbourhood; and of those on that side, how many decide the weights.
inline constexpr std::size_t kGuideCandidates = 12, kBlendCandidates = 4;

// Two strands are on the same side of a parting when their directions at the root, taken over the
// first third, and the normals of the skin there are within 60 degrees of each other.
inline constexpr double kSameSideCosine = 0.5;

// Tells sides of partings apart. Safe to use from many threads.
class SameSide {
  public:
    // `roots` must outlive it; without normals the directions alone decide.
    SameSide(const Groom& groom, const Roots& roots);
    bool operator()(std::size_t a, std::size_t b) const {
        return direction_[a].dot(direction_[b]) >= kSameSideCosine &&
               (normal_.empty() || normal_[a].dot(normal_[b]) >= kSameSideCosine);
    }

  private:
    std::vector<Vec3> direction_;
    std::span<const Vec3> normal_;
};

// The blend of the first three guides, nearest first; the fourth, if there is one, says how far a
// guide reaches.
GuideBlend blend_nearest(std::span<const std::uint32_t> guide, std::span<const double> distance);

// Blends the three nearest guides (by strand feature) of the strand's own group and side of a
// parting, with weights ((R - d) / (R d))^2, d the distance of the guide and R that of the fourth
// (Franke and Little's modification of Shepard's weights): a guide's weight goes to zero before
// another takes its place, so neighbouring strands move alike. A guide follows itself alone. Blends
// authored in the curve file win where their guides are guides. Where no guide is on the strand's
// side the nearest one is taken alone.
//   guides  strand numbers, ascending
//   motion  if there: the guides, out of the nearest on the strand's side, and their weights are
//           those that meet its motion best (stage/motion_guides) instead
std::vector<GuideBlend> blend_guides(const Groom& groom, std::span<const StrandFeature> features,
                                     std::span<const std::uint32_t> guides, const Roots& roots,
                                     const Recipe& recipe, Findings& findings,
                                     const GroomMotion* motion = nullptr);

// Direction of a strand over its first third, unit length.
Vec3 root_direction(std::span<const Vec3> points);

}  // namespace keratin
