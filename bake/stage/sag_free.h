// A rest shape that gravity pulls into the groomed one: hair starts in equilibrium instead of
// sagging off its groom (METHODS 1.4, Beyond), for the strand solver and, apart from it, for the
// rod solver.
#pragma once

#include "bake/report.h"
#include "bake/stage/asset_arrays.h"
#include "schema/asset.h"
#include "schema/read/recipe.h"

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace keratin {

// Whether the recipe asks for it, for each group of the asset: for the strand solver, for rods.
std::vector<std::uint8_t> sag_free_groups(std::span<const GroupInfo> groups, const Recipe& recipe);
std::vector<std::uint8_t> rod_sag_free_groups(std::span<const GroupInfo> groups,
                                              const Recipe& recipe);

// Replaces the rest edges in `arrays.guide_shape` of the guides in the `chosen` groups by those
// with which the moments of the solver's local shape (schema/bend.h) carry the weight in the
// groomed pose, gravity 9.81 m/s^2 along -y; lengths stay. A pose that no rest shape holds, or
// holds only until it is nudged, gets the rest shape with which it settles nearest to the groom,
// and is named in the findings.
//   groups  of the asset
//   chosen  [groups]
// Not taken into account: what bears hair besides its own stiffness (colliders, the grid's volume).
BakeReport::SagFree make_sag_free(std::span<const GroupInfo> groups,
                                  std::span<const std::uint8_t> chosen, AssetArrays& arrays,
                                  Findings& findings);

// A guide as a rod that bears its weight, gravity 9.81 m/s^2 along -y: what the rod solver's
// statics say of it (runtime/rod/rod_statics.h).
struct HeldRod {
    std::vector<std::array<float, 4>> strain;  // [points - 1], as guide_rod_strain has them
    bool held = false;
    double residual = 0, settles = 0;  // as BakeReport::SagFree
};
//   points    [2..] m, root first, clamped at the root along the first segment
//   director  m_1 at the root, unit
// Called from many threads at a time.
using HoldRod = std::function<HeldRod(std::span<const std::array<double, 3>> points,
                                      const std::array<double, 3>& director, const Material&)>;

// Fills `arrays.guide_rod_strain`: of the guides in the `chosen` groups the strain that bears their
// weight in the groomed pose, of the others none. A pose that no rest shape holds, or holds only
// until it is nudged, is named in the findings.
//   groups  of the asset
//   chosen  [groups]
BakeReport::SagFree make_rods_sag_free(std::span<const GroupInfo> groups,
                                       std::span<const std::uint8_t> chosen, const HoldRod& hold,
                                       AssetArrays& arrays, Findings& findings);

}  // namespace keratin
