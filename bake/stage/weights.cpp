#include "bake/stage/weights.h"

#include "bake/stage/motion.h"
#include "bake/stage/motion_guides.h"
#include "schema/layout.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

namespace keratin {
namespace {

// Where there is no fourth guide, R as a multiple of the farthest distance.
constexpr double kReach = 1.5;
// Nearer than this a strand coincides with its guide.
constexpr double kCoincident = 1e-9;  // m

// Authored blends by strand; false where there is none that can be used.
bool authored_blend(const Groom& groom, std::size_t s,
                    const std::map<std::uint32_t, std::uint32_t>& guide_of_id, GuideBlend& out) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double w = groom.guide_weights[s][k];
        const auto found = guide_of_id.find(groom.closest_guides[s][k]);
        if (!(w >= 0) || (w > 0 && found == guide_of_id.end())) return false;
        out.weight[k] = w;
        out.guide[k] = found == guide_of_id.end() ? kNoStrand : found->second;
        sum += w;
    }
    if (!(sum > 0)) return false;
    const std::size_t heaviest = static_cast<std::size_t>(
        std::max_element(out.weight.begin(), out.weight.end()) - out.weight.begin());
    for (std::size_t k = 0; k < 3; ++k) {
        if (out.guide[k] == kNoStrand) out.guide[k] = out.guide[heaviest];
        out.weight[k] /= sum;
    }
    return true;
}

}  // namespace

GuideBlend blend_nearest(std::span<const std::uint32_t> guide, std::span<const double> distance) {
    GuideBlend out;
    const std::size_t n = std::min<std::size_t>(guide.size(), 3);
    out.guide.fill(guide.front());
    if (n == 1 || distance.front() < kCoincident) {
        for (std::size_t k = 0; k < n; ++k) out.guide[k] = guide[k];
        return out;
    }
    const double reach = guide.size() > 3 ? distance[3] : kReach * distance[n - 1];
    double sum = 0;
    for (std::size_t k = 0; k < n; ++k) {
        const double w = (reach - distance[k]) / (reach * distance[k]);
        out.guide[k] = guide[k];
        out.weight[k] = w * w;
        sum += out.weight[k];
    }
    // All at the same distance as the fourth.
    if (!(sum > 0)) {
        for (std::size_t k = 0; k < n; ++k) out.weight[k] = 1.0 / static_cast<double>(n);
        return out;
    }
    for (double& w : out.weight) w /= sum;
    return out;
}

SameSide::SameSide(const Groom& groom, const Roots& roots)
    : direction_(groom.strand_count()), normal_(roots.normal) {
#pragma omp parallel for schedule(static)
    for (std::size_t s = 0; s < direction_.size(); ++s) {
        direction_[s] = root_direction(groom.points(s));
    }
}

Vec3 root_direction(std::span<const Vec3> points) {
    const std::size_t third = std::max<std::size_t>(1, (points.size() - 1) / 3);
    const Vec3 d = points[third] - points.front();
    const double length = d.norm();
    return length > 0 ? Vec3(d / length) : Vec3(Vec3::Zero());
}

std::vector<GuideBlend> blend_guides(const Groom& groom, std::span<const StrandFeature> features,
                                     std::span<const std::uint32_t> guides, const Roots& roots,
                                     const Recipe& recipe, Findings& findings,
                                     const GroomMotion* motion) {
    const std::size_t n = groom.strand_count();
    std::vector<GuideBlend> out(n);
    const SameSide same_side(groom, roots);
    Eigen::MatrixXf moved;
    if (motion != nullptr) {
        std::vector<std::uint32_t> all(n);
        std::iota(all.begin(), all.end(), 0u);
        moved = sampled_motion(groom, *motion, all);
    }

    std::map<std::uint32_t, std::uint32_t> guide_of_id;
    const bool authored = !groom.closest_guides.empty() && !groom.guide_weights.empty();
    if (authored) {
        for (std::uint32_t g : guides) guide_of_id[groom.id[g]] = g;
    }
    std::vector<std::uint8_t> is_guide(n, 0);
    for (std::uint32_t g : guides) is_guide[g] = 1;

    std::vector<std::vector<std::uint32_t>> own(groom.group_names.size());
    std::vector<std::vector<std::uint32_t>> members(groom.group_names.size());
    for (std::uint32_t g : guides) own[groom.group[g]].push_back(g);
    for (std::size_t s = 0; s < n; ++s) {
        members[groom.group[s]].push_back(static_cast<std::uint32_t>(s));
    }

    std::vector<std::uint8_t> dropped(n, 0);
    for (std::size_t g = 0; g < own.size(); ++g) {
        if (members[g].empty()) continue;
        std::vector<StrandFeature> of_guides;
        for (std::uint32_t s : own[g]) of_guides.push_back(features[s]);
        const FeatureTree tree(of_guides);
        if (own[g].size() < 3) {
            findings.push_back({Rule::few_guides,
                                "",
                                "group " + groom.group_names[g] + " has only " +
                                    std::to_string(own[g].size()) + " guides",
                                {}});
        }
        const auto blend = [&](std::uint32_t s) {
            if (is_guide[s]) {
                out[s].guide.fill(s);
                return;
            }
            if (authored && groom.closest_guides[s][0] != kNoStrand) {
                if (authored_blend(groom, s, guide_of_id, out[s])) return;
                dropped[s] = 1;
                out[s] = {};
            }
            std::array<std::uint32_t, kGuideCandidates> index;
            std::array<double, kGuideCandidates> squared;
            const std::size_t found = tree.nearest(features[s], index, squared);
            std::array<std::uint32_t, kGuideCandidates> guide;
            std::array<double, kGuideCandidates> distance;
            std::size_t kept = 0;
            for (std::size_t k = 0; k < found; ++k) {
                const std::uint32_t candidate = own[g][index[k]];
                if (!same_side(s, candidate)) continue;
                guide[kept] = candidate;
                distance[kept++] = std::sqrt(squared[k]);
            }
            if (kept == 0) {
                guide[0] = own[g][index[0]];
                distance[0] = 0;
                kept = 1;
            }
            out[s] = motion != nullptr ? fit_blend(moved, s, std::span(guide).first(kept))
                                       : blend_nearest(std::span(guide).first(kept),
                                                       std::span(distance).first(kept));
        };
#pragma omp parallel for schedule(dynamic, 512)
        for (std::size_t i = 0; i < members[g].size(); ++i) blend(members[g][i]);
    }

    if (authored) {
        std::vector<std::vector<std::uint32_t>> lost(recipe.curves.size());
        for (std::size_t s = 0; s < n; ++s) {
            if (dropped[s]) lost[groom.source[s]].push_back(groom.curve[s]);
        }
        for (std::size_t f = 0; f < lost.size(); ++f) {
            if (lost[f].empty()) continue;
            std::sort(lost[f].begin(), lost[f].end());
            findings.push_back({Rule::authored_dropped, recipe.curves[f].file,
                                std::to_string(lost[f].size()) +
                                    " strands name guides that are none, or weights without a sum; "
                                    "their weights were computed",
                                to_ranges(lost[f])});
        }
    }
    return out;
}

}  // namespace keratin
