#include "tests/schema/small_asset.h"

namespace keratin::test {

namespace {

constexpr std::uint32_t kGuides = 5, kPoints = 4, kStrands = 7;
constexpr float kSegment = 0.01f, kSpacing = 0.005f;

}  // namespace

SmallAsset small_asset() {
    SmallAsset a;
    a.info.tool_version = "test";
    a.info.groups.push_back({"default", {}, {}});
    a.info.inputs.push_back({"curves", "test.tfx", {1, 2}});
    a.info.colliders.push_back({{0, -1, 0}, {0, -1, 0}, 0.5f, 0});
    a.info.tile_count = kQuadTiles;
    a.info.row_count = kQuadTiles * kPoints;
    a.info.guide_count = kGuides;
    a.info.strand_count = kStrands;
    a.info.point_count = kStrands * kPoints;
    a.info.vertex_count = a.info.mesh_vertex_count = 3;
    a.info.triangle_count = a.info.mesh_triangle_count = 1;
    a.info.mesh_topology_hash = {3, 4};
    a.info.bounds_max = {kSpacing * kStrands, kSegment * (kPoints - 1), 0};

    const std::size_t lanes = kQuadTiles * kTileLanes;
    a.guide_point_count.assign(lanes, 0);
    a.guide_strand.assign(lanes, kNoStrand);
    a.guide_group.assign(lanes, 0);
    a.guide_triangle.assign(lanes, 0);
    a.guide_barycentric.assign(lanes * 2, 0.25f);
    a.guide_position.assign(a.info.row_count * kTileLanes * 3, 0);
    a.guide_length.assign(a.info.row_count * kTileLanes, 0);
    a.guide_shape.assign(a.info.row_count * kTileLanes * 3, 0);
    for (std::uint32_t t = 0; t <= kQuadTiles; ++t) a.tile_first_row.push_back(t * kPoints);
    for (std::uint32_t t = 0; t < kQuadTiles; ++t)
        for (std::uint32_t lane = 0; lane < kTileLanes; ++lane) {
            const std::uint32_t guide = t * kTileLanes + lane;
            if (guide < kGuides) {
                a.guide_point_count[guide] = kPoints;
                a.guide_strand[guide] = guide;
            }
            for (std::uint32_t p = 0; p < kPoints; ++p) {
                const std::size_t row = a.tile_first_row[t] + p;
                a.guide_position[vector_index(row, 3, 0, lane)] = kSpacing * float(guide);
                a.guide_position[vector_index(row, 3, 1, lane)] = kSegment * float(p);
                a.guide_length[scalar_index(row, lane)] = guide < kGuides && p > 0 ? kSegment : 0;
                if (p == 0)
                    a.guide_shape[vector_index(row, 3, 0, lane)] = 1;
                else
                    a.guide_shape[vector_index(row, 3, 2, lane)] = kSegment;
            }
        }
    for (std::uint32_t s = 0; s < kStrands; ++s) {
        a.strand_first_point.push_back(s * kPoints);
        for (std::uint32_t p = 0; p < kPoints; ++p)
            a.strand_position.insert(a.strand_position.end(),
                                     {kSpacing * float(s), kSegment * float(p), 0});
        const std::uint32_t nearest = std::min(s, kGuides - 1);
        a.strand_guide.insert(a.strand_guide.end(), {nearest, 0, 1});
        a.strand_weight.insert(a.strand_weight.end(), {0.5f, 0.25f, 0.25f});
        a.strand_id.push_back(s);
        a.strand_group.push_back(0);
        a.strand_triangle.push_back(0);
        a.strand_barycentric.insert(a.strand_barycentric.end(), {0.1f, 0.2f});
        a.strand_uv.insert(a.strand_uv.end(), {0.5f, 0.5f});
    }
    a.strand_first_point.push_back(kStrands * kPoints);
    a.mesh_position = {-1, 0, -1, 1, 0, -1, 0, 0, 1};
    a.mesh_triangle = {0, 1, 2};
    return a;
}

AssetFields SmallAsset::fields() const {
    AssetFields f;
    f.tile_first_row = tile_first_row;
    f.guide_point_count = guide_point_count;
    f.guide_strand = guide_strand;
    f.guide_group = guide_group;
    f.guide_position = guide_position;
    f.guide_length = guide_length;
    f.guide_shape = guide_shape;
    f.guide_triangle = guide_triangle;
    f.guide_barycentric = guide_barycentric;
    f.strand_first_point = strand_first_point;
    f.strand_position = strand_position;
    f.strand_guide = strand_guide;
    f.strand_weight = strand_weight;
    f.strand_id = strand_id;
    f.strand_group = strand_group;
    f.strand_triangle = strand_triangle;
    f.strand_barycentric = strand_barycentric;
    f.strand_uv = strand_uv;
    f.mesh_position = mesh_position;
    f.mesh_triangle = mesh_triangle;
    return f;
}

}  // namespace keratin::test
