// Which items of two assets answer to each other, field domain by field domain, and what people
// call them: the ids and source numbers instead of places in a file.
#pragma once

#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/match.h"

#include <cstdint>
#include <string>
#include <vector>

namespace keratin::diff {

// An item of a and its counterpart in b.
struct Pair {
    std::uint32_t owner_a, owner_b;  // strand, guide (lane index), vertex, triangle or brick
    std::size_t a, b;                // item within its domain: schema/layout.h's scalar index
    std::uint32_t point = kNoMatch;  // of point and row domains
};

inline bool is_tiled(Domain domain) { return domain == Domain::lane || domain == Domain::row; }

// Where component c of an item lies in its field.
inline std::size_t element_index(Domain domain, std::size_t item, std::size_t components,
                                 std::size_t c) {
    return is_tiled(domain) ? vector_index(item / kTileLanes, components, c, item % kTileLanes)
                            : item * components + c;
}

inline std::uint32_t point_count(const AssetView& asset, std::uint32_t strand) {
    const auto& first = asset.fields().strand_first_point;
    return first[strand + 1] - first[strand];
}

inline bool same_lattice(const DistanceGridInfo& a, const DistanceGridInfo& b) {
    return a.origin == b.origin && a.spacing == b.spacing && a.bricks == b.bricks;
}

// Keeps the assets by reference.
class Counterparts {
  public:
    Counterparts(const AssetView& a, const AssetView& b);

    const Match& strands() const { return strands_; }
    const Match& guides() const { return guides_; }
    const Match& vertices() const { return vertices_; }
    const Match& triangles() const { return triangles_; }
    const Match& groups() const { return groups_; }
    const Match& bones() const { return bones_; }

    // Calls visit(Pair) for each pair of a domain, in the order of a. Strands and guides whose
    // number of points changed have no points to pair.
    template <class Visit>
    void for_each_pair(Domain domain, Visit&& visit) const;
    // How many strands or guides these are.
    std::size_t pairs_left_out(Domain domain) const;

    // Triangles of the source meshes have the same numbers.
    bool same_topology() const;

    // "strand 17", "guide of strand 17", "vertex 4": of an item of a.
    std::string item_name(Domain domain, std::uint32_t owner) const;

    // The counterpart in b of what an index of a points to; kNoMatch: there is none.
    std::uint32_t counterpart(Domain target, std::uint32_t index) const {
        const Match* match = match_of(target);
        if (!match || index == kNoStrand) return index;
        return match->to_b[index];
    }
    // Appends what an index points to, as a number or a name.
    void describe_index(const AssetView& asset, Domain target, std::uint32_t index,
                        std::vector<double>& numbers, std::vector<std::string>& names) const;

    ListChange list_change(const Match& match, Domain domain, bool ordered) const;

  private:
    const Match* match_of(Domain target) const;

    const AssetView &a_, &b_;
    Match strands_, guides_, vertices_, triangles_, groups_, bones_;
};

template <class Visit>
void Counterparts::for_each_pair(Domain domain, Visit&& visit) const {
    const auto each = [&](const Match& match, auto&& inner) {
        for (std::uint32_t i = 0; i < match.to_b.size(); ++i)
            if (match.to_b[i] != kNoMatch) inner(i, match.to_b[i]);
    };
    const auto itself = [&](std::uint32_t i, std::uint32_t j) { visit(Pair{i, j, i, j}); };
    switch (domain) {
        case Domain::strand:
            return each(strands_, itself);
        case Domain::lane:
            return each(guides_, itself);
        case Domain::vertex:
            return each(vertices_, itself);
        case Domain::triangle:
            return each(triangles_, itself);
        case Domain::point:
            return each(strands_, [&](std::uint32_t i, std::uint32_t j) {
                const std::uint32_t count = point_count(a_, i);
                if (count != point_count(b_, j)) return;
                const std::size_t first_a = a_.fields().strand_first_point[i];
                const std::size_t first_b = b_.fields().strand_first_point[j];
                for (std::uint32_t p = 0; p < count; ++p)
                    visit(Pair{i, j, first_a + p, first_b + p, p});
            });
        case Domain::row:
            return each(guides_, [&](std::uint32_t i, std::uint32_t j) {
                const AssetFields &fa = a_.fields(), &fb = b_.fields();
                const std::uint32_t count = fa.guide_point_count[i];
                if (count != fb.guide_point_count[j]) return;
                const std::size_t row_a = fa.tile_first_row[i / kTileLanes];
                const std::size_t row_b = fb.tile_first_row[j / kTileLanes];
                for (std::uint32_t p = 0; p < count; ++p)
                    visit(Pair{i, j, scalar_index(row_a + p, i % kTileLanes),
                               scalar_index(row_b + p, j % kTileLanes), p});
            });
        case Domain::brick:
        case Domain::brick_node: {
            // Bricks answer to each other when both grids have the same lattice.
            const AssetFields &fa = a_.fields(), &fb = b_.fields();
            if (!same_lattice(a_.info().distance_grid, b_.info().distance_grid)) return;
            for (std::uint32_t i = 0; i < fa.grid_brick.size(); ++i) {
                if (domain == Domain::brick) {
                    itself(i, i);
                } else if (fa.grid_brick[i] != kNoBrick && fb.grid_brick[i] != kNoBrick) {
                    for (std::size_t n = 0; n < kBrickNodes; ++n)
                        visit(Pair{i, i, std::size_t{fa.grid_brick[i]} * kBrickNodes + n,
                                   std::size_t{fb.grid_brick[i]} * kBrickNodes + n});
                }
            }
            return;
        }
        default:
            return;
    }
}

}  // namespace keratin::diff
