// The bones that carry each root: from .tfxbone files, or from the mesh's skin at the root.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/roots.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// Arrays are empty when nothing names a bone: one rigid motion carries everything.
struct Carriers {
    std::vector<std::string> bones;
    std::vector<std::array<std::uint32_t, 4>> bone;  // [strand_count]
    std::vector<std::array<double, 4>> weight;       // [strand_count] >= 0, sum 1, heaviest first
};

// skins  [curve files]  what the file's .tfxbone says, one entry a curve; absent without one
// Bones of several files are merged by name, in the order in which they are first met. Where a file
// has no .tfxbone the mesh's skin is blended with the root's barycentrics. Strands without either
// follow the first bone, which is reported.
// Errors (input): a .tfxbone file with another number of strands than its curve file, or a bone
// number outside its own list.
Result<Carriers> carry_roots(const Groom& groom, std::span<const std::optional<RawSkin>> skins,
                             const RawMesh* mesh, const Roots& roots, const Recipe& recipe,
                             std::span<const std::size_t> curve_counts, Findings& findings);

}  // namespace keratin
