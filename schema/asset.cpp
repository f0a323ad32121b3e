#include "schema/asset.h"

namespace keratin {

std::uint64_t domain_count(const AssetInfo& info, Domain domain) {
    switch (domain) {
        case Domain::none:
            return 0;
        case Domain::tile_edge:
            return std::uint64_t{info.tile_count} + 1;
        case Domain::lane:
            return std::uint64_t{info.tile_count} * kTileLanes;
        case Domain::row:
            return std::uint64_t{info.row_count} * kTileLanes;
        case Domain::strand:
            return info.strand_count;
        case Domain::strand_edge:
            return std::uint64_t{info.strand_count} + 1;
        case Domain::point:
            return info.point_count;
        case Domain::vertex:
            return info.vertex_count;
        case Domain::triangle:
            return info.triangle_count;
        case Domain::group:
            return info.groups.size();
        case Domain::bone:
            return info.bones.size();
        case Domain::mesh_vertex:
            return info.mesh_vertex_count;
        case Domain::mesh_triangle:
            return info.mesh_triangle_count;
        case Domain::brick: {
            const auto& n = info.distance_grid.bricks;
            return std::uint64_t{n[0]} * n[1] * n[2];
        }
        case Domain::brick_node:
            return std::uint64_t{info.distance_grid.stored_bricks} * kBrickNodes;
        case Domain::stored_brick:
            return info.distance_grid.stored_bricks;
    }
    return 0;
}

float width_scale(std::span<const LevelOfDetail> levels, std::uint32_t strand_count,
                  std::uint32_t drawn) {
    if (drawn == 0 || drawn >= strand_count) return 1;
    // Ends of the piece that `drawn` lies on: strands drawn, share covered.
    double more = strand_count, more_share = 1, less = 0, less_share = 0;
    for (const LevelOfDetail& level : levels) {
        const double share = 1.0 / double{level.width_scale};
        if (level.strand_count >= drawn) {
            more = level.strand_count, more_share = share;
        } else {
            less = level.strand_count, less_share = share;
            break;
        }
    }
    const double t = more > less ? (double(drawn) - less) / (more - less) : 1;
    return static_cast<float>(1.0 / (less_share + t * (more_share - less_share)));
}

}  // namespace keratin
