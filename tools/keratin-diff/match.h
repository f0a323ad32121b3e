// Which strand, guide, vertex or triangle of one asset is which of another. Nothing is matched by
// its place in the file: a bake may sort strands in another way and still mean the same groom.
#pragma once

#include "schema/asset_view.h"

#include <cstdint>
#include <string>
#include <vector>

namespace keratin::diff {

inline constexpr std::uint32_t kNoMatch = 0xffffffffu;

// One-to-one, in both directions; kNoMatch where an item has no counterpart.
struct Match {
    std::vector<std::uint32_t> to_b;  // [items of a]
    std::vector<std::uint32_t> to_a;  // [items of b]

    Match(std::size_t a_count, std::size_t b_count)
        : to_b(a_count, kNoMatch), to_a(b_count, kNoMatch) {}
    void join(std::uint32_t a, std::uint32_t b) {
        to_b[a] = b;
        to_a[b] = a;
    }
};

// Render strands, in this order, each step on what the steps before left over:
//   1. the same id and the same points
//   2. the same points under another id
//   3. the same id, if ids can be trusted: no more strands were matched by step 2 than by step 1;
//      an id that several strands share is no id
//   4. where ids cannot be trusted or are shared: the nearest root and most similar shape, closest
//      pairs first, as long as root and shape together moved by less than half a strand's length
// What is left was removed or added.
Match match_strands(const AssetView& a, const AssetView& b);

// Guides, as lane indices (tile * 16 + lane): those of the same render strand with the same points,
// then those with the same points, then those of the same render strand. Empty lanes match nothing.
Match match_guides(const AssetView& a, const AssetView& b, const Match& strands);

// Stored mesh vertices: by their number in the source mesh (if both meshes have the same topology),
// then by equal position.
Match match_vertices(const AssetView& a, const AssetView& b);

// Stored triangles: by their number in the source mesh (likewise), then by equal (matched) corners.
Match match_triangles(const AssetView& a, const AssetView& b, const Match& vertices);

// By name; what is left by its place in the list (it was renamed).
Match match_names(const std::vector<std::string>& a, const std::vector<std::string>& b);

// How many matched items stand at another place relative to the others: the fewest that would have
// to be moved to bring b into the order of a.
struct Reordered {
    std::size_t count = 0;
    std::uint32_t example = kNoMatch;  // the first of them, in a
};
Reordered count_reordered(const Match& match);

}  // namespace keratin::diff
