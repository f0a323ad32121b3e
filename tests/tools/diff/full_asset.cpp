#include "tests/tools/diff/full_asset.h"

#include "tests/schema/small_asset.h"

#include <algorithm>
#include <numeric>

namespace keratin::test {

AssetFields FullAsset::fields() const {
    AssetFields all;
#define X(name, element, domain, components, presence, target, unit, meaning) all.name = name;
    KERATIN_ASSET_FIELDS(X)
#undef X
    return all;
}

FullAsset full_asset() {
    const SmallAsset small = small_asset();
    FullAsset a;
    a.info = small.info;
    const AssetFields from = small.fields();
#define X(name, element, domain, components, presence, target, unit, meaning) \
    a.name.assign(from.name.begin(), from.name.end());
    KERATIN_ASSET_FIELDS(X)
#undef X

    a.info.groups.push_back({"fringe", {}, {}});
    a.info.bones = {"neck", "head", "jaw"};
    a.info.mesh_vertex_count = 6;
    a.info.mesh_triangle_count = 5;
    a.info.vertex_count = 5;
    a.info.triangle_count = 3;
    a.mesh_position = {-1, 0, -1, 1, 0, -1, 0, 0, 1, 2, 0, 1, -2, 0, 1};
    a.mesh_uv = {0, 0, 1, 0, 0.5f, 1, 1, 1, 0, 1};
    a.mesh_vertex_source = {0, 1, 2, 3, 4};
    a.mesh_triangle = {0, 1, 2, 1, 3, 2, 0, 2, 4};
    a.mesh_triangle_source = {0, 2, 3};

    a.info.distance_grid = {{0, 0, 0}, 0.01f, {2, 1, 1}, 2, 0, 1e-4f};
    a.grid_brick = {0, 1};
    a.grid_distance.assign(2 * kBrickNodes, 0.05f);

    a.info.levels = {{3, 2.5f}, {1, 7}};
    a.info.guide_error = {"kmeans", 0.001f, 0.004f, 0.02f};

    const std::size_t lanes = a.guide_strand.size(), strands = a.strand_id.size();
    a.guide_rod_strain.assign(4 * a.guide_length.size(), 1e-3f);
    a.guide_density.assign(a.guide_length.size(), 40);
    a.guide_bone.assign(lanes * 4, 0);
    a.guide_bone_weight.assign(lanes * 4, 0);
    for (std::size_t guide = 0; guide < lanes; ++guide) {
        const std::size_t tile = guide / kTileLanes, lane = guide % kTileLanes;
        a.guide_bone[vector_index(tile, 4, 1, lane)] = 1;
        a.guide_bone_weight[vector_index(tile, 4, 0, lane)] = 0.75f;
        a.guide_bone_weight[vector_index(tile, 4, 1, lane)] = 0.25f;
    }
    for (std::size_t s = 0; s < strands; ++s) {
        a.strand_bone.insert(a.strand_bone.end(), {0, 1, 0, 0});
        a.strand_bone_weight.insert(a.strand_bone_weight.end(), {0.75f, 0.25f, 0, 0});
        a.strand_radius.push_back(3e-5f);
        for (const float fraction : {0.0f, 0.25f, 0.6f, 1.0f})
            a.strand_fraction.push_back(fraction);
    }
    return a;
}

namespace {

// Component c of item i of a tiled field moves from its old to its new lane.
template <class Element>
std::vector<Element> relaid(const std::vector<Element>& values, std::size_t components,
                            const std::vector<std::size_t>& from) {
    if (values.empty()) return {};
    std::vector<Element> result(from.size() * components);
    for (std::size_t i = 0; i < from.size(); ++i)
        for (std::size_t c = 0; c < components; ++c)
            result[vector_index(i / kTileLanes, components, c, i % kTileLanes)] =
                values[vector_index(from[i] / kTileLanes, components, c, from[i] % kTileLanes)];
    return result;
}

template <class Element>
std::vector<Element> taken(const std::vector<Element>& values, std::size_t components,
                           const std::vector<std::size_t>& from) {
    if (values.empty()) return {};
    std::vector<Element> result;
    for (const std::size_t i : from)
        for (std::size_t c = 0; c < components; ++c) result.push_back(values[i * components + c]);
    return result;
}

}  // namespace

void lay_out_guides(FullAsset& asset, const std::vector<std::uint32_t>& order, std::uint32_t rows) {
    const std::size_t lanes = kQuadTiles * kTileLanes;
    std::vector<std::size_t> from_lane(lanes), from_row, now_lane(lanes);
    std::iota(from_lane.begin(), from_lane.end(), 0u);
    std::copy(order.begin(), order.end(), from_lane.begin());
    for (std::size_t i = 0; i < lanes; ++i) now_lane[from_lane[i]] = i;
    for (std::size_t t = 0; t < kQuadTiles; ++t)
        for (std::uint32_t p = 0; p < rows; ++p)
            for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
                const std::size_t old = from_lane[scalar_index(t, lane)];
                const std::size_t tile = old / kTileLanes;
                const std::uint32_t old_rows =
                    asset.tile_first_row[tile + 1] - asset.tile_first_row[tile];
                from_row.push_back(scalar_index(
                    asset.tile_first_row[tile] + std::min(p, old_rows - 1), old % kTileLanes));
            }
#define X(name, element, domain_, components, presence, target, unit, meaning) \
    if (Domain::domain_ == Domain::lane)                                       \
        asset.name = relaid(asset.name, components, from_lane);                \
    else if (Domain::domain_ == Domain::row)                                   \
        asset.name = relaid(asset.name, components, from_row);
    KERATIN_ASSET_FIELDS(X)
#undef X
    for (std::uint32_t& guide : asset.strand_guide)
        guide = static_cast<std::uint32_t>(now_lane[guide]);
    for (std::uint32_t t = 0; t <= kQuadTiles; ++t) asset.tile_first_row[t] = t * rows;
    asset.info.row_count = kQuadTiles * rows;
    // Rows below the tip repeat the last point with length 0.
    for (std::size_t t = 0; t < kQuadTiles; ++t)
        for (std::size_t lane = 0; lane < kTileLanes; ++lane)
            for (std::size_t p = asset.guide_point_count[scalar_index(t, lane)]; p < rows; ++p)
                asset.guide_length[scalar_index(t * rows + p, lane)] = 0;
}

void lay_out_strands(FullAsset& asset, const std::vector<std::uint32_t>& order) {
    std::vector<std::size_t> strand(order.begin(), order.end()), point;
    std::vector<std::uint32_t> first{0};
    for (const std::uint32_t s : order) {
        for (std::uint32_t p = asset.strand_first_point[s]; p < asset.strand_first_point[s + 1];
             ++p)
            point.push_back(p);
        first.push_back(static_cast<std::uint32_t>(point.size()));
    }
#define X(name, element, domain_, components, presence, target, unit, meaning) \
    if (Domain::domain_ == Domain::strand)                                     \
        asset.name = taken(asset.name, components, strand);                    \
    else if (Domain::domain_ == Domain::point)                                 \
        asset.name = taken(asset.name, components, point);
    KERATIN_ASSET_FIELDS(X)
#undef X
    asset.strand_first_point = first;
    asset.info.strand_count = static_cast<std::uint32_t>(order.size());
    asset.info.point_count = static_cast<std::uint32_t>(point.size());
    for (std::uint32_t& s : asset.guide_strand)
        if (s != kNoStrand)
            s = static_cast<std::uint32_t>(std::find(order.begin(), order.end(), s) -
                                           order.begin());
}

}  // namespace keratin::test
