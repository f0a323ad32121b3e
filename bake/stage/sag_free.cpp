#include "bake/stage/sag_free.h"

#include "bake/stage/strand_statics.h"
#include "schema/formula/frame.h"
#include "schema/material.h"

#include <algorithm>
#include <optional>

namespace keratin {
namespace {

using V = Vec3<double>;

const V kGravity(0, -9.81, 0);  // m/s^2

// A pose is held when what is left unbalanced is below this share of the strand's weight ...
constexpr double kHeld = 1e-6;
// ... and its softest motion is stiffer than this share of the weight at the strand's length; a
// pose that hair falls into, out of motion, has to be firmer.
constexpr double kFirm = 1e-3, kFirmer = 5e-3;

// For strands that cannot be held: shares of the largest moment that are tried as a bound for every
// joint, and halvings of the way from where that makes them sag to back to the groom.
constexpr double kBounds[] = {0, 0.9, 0.6, 0.3};
constexpr int kHalvings = 6;
// Residual up to which the pose that a strand settles in is believed. Joints that are bent nearly
// right round have moments without an energy (bend_reaction bounds them), and the descent can
// stall.
constexpr double kSettled = 1e-2;

using Guide = BakeReport::SagFree::Guide;

// Largest distance of two poses' points.
double farthest(std::span<const double> lengths, std::span<const V> a, std::span<const V> b) {
    V apart(0, 0, 0);
    double most = 0;
    for (std::size_t m = 1; m < a.size(); ++m) {
        apart += (a[m] - b[m]) * lengths[m];
        most = std::max(most, length(apart));
    }
    return most;
}

// Whether a rest shape, which s then has, holds the pose t.
bool holds(StrandStatics& s, std::span<const V> t, double margin) {
    carry_weight(s, t, 1);
    return residual(s, t) < kHeld && stable(s, t, margin);
}

// Makes the strand as sag-free as can be.
Guide hold(std::span<const V> points, StrandStatics& s) {
    const std::vector<V> groomed = directions(points);
    const StrandStatics plain = s;
    Guide out;
    out.held = holds(s, groomed, kFirm);
    out.residual = residual(s, groomed);
    if (out.held) return out;

    // No rest shape holds the groomed pose, or only until it is nudged. Where the strand sags to,
    // one does: with which the strand comes to rest at the nearest pose on the way back from there
    // to the groomed one that can be held.
    StrandStatics best = plain;
    out.settles = farthest(s.length, settled(plain, groomed), groomed);
    for (const double bound : kBounds) {
        s = plain;
        carry_weight(s, groomed, bound);
        const std::vector<V> sagged = settled(s, groomed);
        double reached = -1, beyond = 1;
        for (int k = 0; k < kHalvings; ++k) {
            const double share = reached < 0 ? 0 : 0.5 * (reached + beyond);
            std::vector<V> pose = sagged;
            for (std::size_t m = 2; m < pose.size(); ++m)
                pose[m] = normalize_or(sagged[m] * (1 - share) + groomed[m] * share, groomed[m]);
            StrandStatics tried = plain;
            if (holds(tried, pose, kFirmer)) {
                reached = share;
                s = tried;
            } else if (reached < 0) {
                break;
            } else {
                beyond = share;
            }
        }
        if (reached < 0) continue;
        const std::vector<V> there = settled(s, groomed);
        const double settles = farthest(s.length, there, groomed);
        if (settles >= out.settles || residual(s, there) > kSettled) continue;
        out.settles = settles;
        best = s;
    }
    s = best;
    out.residual = residual(s, groomed);
    return out;
}

std::vector<std::uint8_t> chosen_groups(std::span<const GroupInfo> groups, const Recipe& recipe,
                                        bool all, bool GroupRecipe::*own_choice) {
    std::vector<std::uint8_t> out;
    for (const GroupInfo& group : groups) {
        out.push_back(all);
        for (const GroupRecipe& own : recipe.groups)
            if (own.name == group.name) out.back() = own.*own_choice;
    }
    return out;
}

// The report of the guides that were made sag-free; those that could not be are named.
BakeReport::SagFree summary(std::span<const std::optional<Guide>> guides, Rule rule,
                            const char* message, Findings& findings) {
    BakeReport::SagFree out;
    for (const std::optional<Guide>& guide : guides)
        if (guide) out.each.push_back(*guide);
    std::ranges::stable_sort(out.each, {}, &Guide::strand);
    std::vector<double> residuals, settles;
    std::vector<std::uint32_t> soft;
    for (const Guide& guide : out.each) {
        residuals.push_back(guide.residual);
        settles.push_back(guide.settles);
        if (!guide.held) soft.push_back(guide.strand);
    }
    out.guides = out.each.size();
    out.too_soft = soft.size();
    out.residual = spread_of(std::move(residuals));
    out.settles = spread_of(std::move(settles));
    if (!soft.empty())
        findings.push_back({rule, "", std::to_string(soft.size()) + message, to_ranges(soft)});
    return out;
}

}  // namespace

std::vector<std::uint8_t> sag_free_groups(std::span<const GroupInfo> groups, const Recipe& recipe) {
    return chosen_groups(groups, recipe, recipe.sag_free, &GroupRecipe::sag_free);
}

std::vector<std::uint8_t> rod_sag_free_groups(std::span<const GroupInfo> groups,
                                              const Recipe& recipe) {
    return chosen_groups(groups, recipe, recipe.rod_sag_free, &GroupRecipe::rod_sag_free);
}

BakeReport::SagFree make_sag_free(std::span<const GroupInfo> groups,
                                  std::span<const std::uint8_t> chosen, AssetArrays& arrays,
                                  Findings& findings) {
    const std::size_t lanes = arrays.guide_group.size();
    std::vector<std::optional<Guide>> guides(lanes);
#pragma omp parallel for schedule(dynamic, 16)
    for (std::size_t i = 0; i < lanes; ++i) {
        const std::size_t count = arrays.guide_point_count[i];
        if (count < 3 || !chosen[arrays.guide_group[i]]) continue;
        const std::size_t first = arrays.tile_first_row[i / kTileLanes], lane = i % kTileLanes;
        const auto vector = [&](const std::vector<float>& field, std::size_t p) {
            const std::size_t at = vector_index(first + p, 3, 0, lane);
            return V(double(field[at]), double(field[at + kTileLanes]),
                     double(field[at + 2 * kTileLanes]));
        };
        std::vector<V> points;
        for (std::size_t p = 0; p < count; ++p) points.push_back(vector(arrays.guide_position, p));
        StrandStatics s = strand_statics(
            points, bending_per_mass(groups[arrays.guide_group[i]].material), kGravity);
        guides[i] = hold(points, s);
        guides[i]->strand = arrays.strand_id[arrays.guide_strand[i]];

        V t = s.unloaded[1], u = orthonormal_director(t, vector(arrays.guide_shape, 0));
        for (std::size_t p = 1; p < count; ++p) {
            const V c = to_frame(t, u, s.unloaded[p] * s.length[p]);
            const std::size_t at = vector_index(first + p, 3, 0, lane);
            arrays.guide_shape[at] = static_cast<float>(c.x);
            arrays.guide_shape[at + kTileLanes] = static_cast<float>(c.y);
            arrays.guide_shape[at + 2 * kTileLanes] = static_cast<float>(c.z);
            u = transport_director(t, s.unloaded[p], u);
            t = s.unloaded[p];
        }
    }

    // Empty lanes repeat the guide before them.
    for (std::size_t i = 1; i < lanes; ++i) {
        if (arrays.guide_point_count[i] > 0 || !chosen[arrays.guide_group[i]]) continue;
        const std::size_t from = arrays.tile_first_row[(i - 1) / kTileLanes];
        const std::size_t to = arrays.tile_first_row[i / kTileLanes];
        const std::size_t rows = arrays.tile_first_row[i / kTileLanes + 1] - to;
        for (std::size_t k = 0; k < 3 * rows; ++k)
            arrays.guide_shape[(3 * to + k) * kTileLanes + i % kTileLanes] =
                arrays.guide_shape[(3 * from + k) * kTileLanes + (i - 1) % kTileLanes];
    }

    return summary(guides, Rule::sags,
                   " guides are too soft to hold their groomed pose under gravity and will sag; a "
                   "larger `radius` or `youngs_modulus` holds them",
                   findings);
}

BakeReport::SagFree make_rods_sag_free(std::span<const GroupInfo> groups,
                                       std::span<const std::uint8_t> chosen, const HoldRod& hold,
                                       AssetArrays& arrays, Findings& findings) {
    const std::size_t lanes = arrays.guide_group.size();
    arrays.guide_rod_strain.assign(4 * arrays.guide_length.size(), 0);
    std::vector<std::optional<Guide>> guides(lanes);
#pragma omp parallel for schedule(dynamic, 4)
    for (std::size_t i = 0; i < lanes; ++i) {
        const std::size_t count = arrays.guide_point_count[i];
        if (count < 2 || !chosen[arrays.guide_group[i]]) continue;
        const std::size_t first = arrays.tile_first_row[i / kTileLanes], lane = i % kTileLanes;
        const auto vector = [&](const std::vector<float>& field, std::size_t p) {
            std::array<double, 3> out;
            for (std::size_t c = 0; c < 3; ++c)
                out[c] = double(field[vector_index(first + p, 3, c, lane)]);
            return out;
        };
        std::vector<std::array<double, 3>> points;
        for (std::size_t p = 0; p < count; ++p) points.push_back(vector(arrays.guide_position, p));
        const HeldRod rod =
            hold(points, vector(arrays.guide_shape, 0), groups[arrays.guide_group[i]].material);
        guides[i] = {arrays.strand_id[arrays.guide_strand[i]], rod.held, rod.residual, rod.settles};
        for (std::size_t p = 1; p < count; ++p)
            for (std::size_t c = 0; c < 4; ++c)
                arrays.guide_rod_strain[vector_index(first + p, 4, c, lane)] = rod.strain[p - 1][c];
    }
    return summary(guides, Rule::rod_sags,
                   " guides are too soft to hold their groomed pose under gravity as rods and will "
                   "sag; a larger `radius` or `youngs_modulus` holds them",
                   findings);
}

}  // namespace keratin
