// Distances out of a grid of nodes, whole or in bricks.
#pragma once

#include "runtime/pass/trilinear.h"
#include "schema/layout.h"

#include <cstring>

namespace keratin::KERATIN_ISA {

// Distance where a grid knows none: no contact.
inline constexpr float kFarAway = 1e9f;

// Where the nodes of a cell stand.
struct NodeLayout {
    const DistanceNodes& grid;
    std::uint32_t y, z;            // from a node to the next along these axes
    std::uint32_t bricks[2] = {};  // along x and y

    KERATIN_ALWAYS_INLINE explicit NodeLayout(const DistanceNodes& g) : grid(g) {
        y = g.brick ? kBrickCells + 1 : g.nodes[0];
        z = y * (g.brick ? kBrickCells + 1 : g.nodes[1]);
        for (int c = 0; c < 2; ++c) bricks[c] = (g.nodes[c] - 1) / kBrickCells;
    }
    // The cell's brick, and the place of its lowest node there; without bricks, of all nodes.
    KERATIN_ALWAYS_INLINE void find(std::uint32_t cx, std::uint32_t cy, std::uint32_t cz,
                                    std::uint32_t& brick, std::uint32_t& place) const {
        brick = (cz / kBrickCells * bricks[1] + cy / kBrickCells) * bricks[0] + cx / kBrickCells;
        place = grid.brick ? cx % kBrickCells + y * (cy % kBrickCells) + z * (cz % kBrickCells)
                           : cx + y * cy + z * cz;
    }
    // Null where a sparse grid stores nothing.
    KERATIN_ALWAYS_INLINE const float* node(std::uint32_t brick, std::uint32_t place) const {
        if (!grid.brick) return grid.distance + place;
        const std::uint32_t stored = grid.brick[brick];
        return stored == kNoBrick ? nullptr
                                  : grid.distance + std::size_t{stored} * kBrickNodes + place;
    }
};

// Distance and its unit gradient at one point of the grid's space.
inline float node_distance(const DistanceNodes& g, const float p[3], float normal[3]) {
    normal[0] = 0, normal[1] = 1, normal[2] = 0;
    std::uint32_t cell[3];
    float f[3];
    for (int c = 0; c < 3; ++c) {
        const float s = (p[c] - g.origin[c]) * g.inverse_spacing;
        const float last = float(g.nodes[c] - 1);
        if (!(s >= 0 && s < last)) return kFarAway;
        cell[c] = std::uint32_t(s);
        f[c] = s - float(cell[c]);
    }
    const NodeLayout at(g);
    std::uint32_t brick, place;
    at.find(cell[0], cell[1], cell[2], brick, place);
    const float* first = at.node(brick, place);
    if (!first) return kFarAway;
    float d[8];
    for (std::size_t k = 0; k < 8; ++k)
        d[k] = first[(k & 1) + (k >> 1 & 1) * at.y + (k >> 2) * at.z];
    Vec3<float> n;
    const float distance = trilinear(d, f, n);
    n = normalize_or(n, Vec3<float>(0, 1, 0));
    normal[0] = n.x, normal[1] = n.y, normal[2] = n.z;
    return distance;
}

// The same for a pack: cells and values for all lanes at once, the nodes lane by lane.
template <bool with_normal, class Pack>
[[gnu::noinline]] Pack pack_distance(const DistanceNodes& g, const Vec3<Pack>& p,
                                     Vec3<Pack>& normal) {
    constexpr std::size_t kLanes = Pack::kLanes;
    const std::uint32_t last[3] = {g.nodes[0] - 1, g.nodes[1] - 1, g.nodes[2] - 1};
    const GridCells<Pack> cells(g.origin, g.inverse_spacing, last, p);
    // Nodes k and k + 1 of a cell lie side by side and are fetched together.
    alignas(64) float node[4][kLanes][2] = {};
    alignas(64) float stored[kLanes] = {};
    bool any_stored = false;
    const NodeLayout at(g);
    alignas(64) std::uint32_t brick[kLanes], place[kLanes];
    for (std::size_t l = 0; l < kLanes; ++l)
        at.find(cells.cell[0][l], cells.cell[1][l], cells.cell[2][l], brick[l], place[l]);
    for_each_lane(cells.inside, [&](std::size_t l) {
        const float* first = at.node(brick[l], place[l]);
        if (!first) return;
        stored[l] = 1;
        any_stored = true;
        for (std::size_t k = 0; k < 4; ++k)
            std::memcpy(node[k][l], first + (k & 1) * at.y + (k >> 1) * at.z, 2 * sizeof(float));
    });
    const Pack zero(0.0f);
    const Vec3<Pack> up(zero, Pack(1.0f), zero);
    normal = up;
    if (!any_stored) return Pack(kFarAway);
    Pack d[8];
    for (int k = 0; k < 4; ++k) load_pairs(node[k][0], d[2 * k], d[2 * k + 1]);
    const auto found = zero < load<Pack>(stored, kTileLanes);
    Vec3<Pack> gradient;
    const Pack distance = trilinear(d, cells.share, gradient);
    if constexpr (with_normal) normal = select(found, normalize_or(gradient, up), up);
    return select(found, distance, Pack(kFarAway));
}

template <class Pack>
KERATIN_ALWAYS_INLINE Pack grid_distance(const DistanceNodes& g, const Vec3<Pack>& p,
                                         Vec3<Pack>& normal) {
    return pack_distance<true>(g, p, normal);
}
template <class Pack>
KERATIN_ALWAYS_INLINE Pack grid_distance(const DistanceNodes& g, const Vec3<Pack>& p) {
    Vec3<Pack> ignored;
    return pack_distance<false>(g, p, ignored);
}

}  // namespace keratin::KERATIN_ISA
