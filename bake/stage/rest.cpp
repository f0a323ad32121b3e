#include "bake/stage/rest.h"

#include "bake/stage/rest_frame.h"
#include "schema/file_hash.h"

#include <algorithm>
#include <array>

namespace keratin {
namespace {

float to_float(double x) { return static_cast<float>(x); }

}  // namespace

std::vector<GroupInfo> group_settings(const Groom& groom, const Recipe& recipe,
                                      Findings& findings) {
    std::vector<GroupInfo> out;
    for (const std::string& name : groom.group_names) {
        GroupInfo group{name, recipe.material, recipe.strand};
        for (const GroupRecipe& own : recipe.groups) {
            if (own.name != name) continue;
            group.material = own.material;
            group.strand = own.strand;
        }
        out.push_back(std::move(group));
    }
    for (const GroupRecipe& own : recipe.groups) {
        if (std::find(groom.group_names.begin(), groom.group_names.end(), own.name) !=
            groom.group_names.end()) {
            continue;
        }
        findings.push_back(
            {Rule::group_unused, recipe.file, "group \"" + own.name + "\" has no strands", {}});
    }
    return out;
}

void store_strands(const Groom& groom, const Roots& roots, const Carriers& carriers,
                   const AssetOrder& order, std::span<const GuideBlend> blends,
                   std::span<const GroupInfo> groups, AssetArrays& out) {
    const std::size_t n = groom.strand_count();
    const bool bound = !roots.triangle.empty();
    const bool boned = !carriers.bone.empty();

    out.strand_first_point.assign(n + 1, 0);
    for (std::size_t i = 0; i < n; ++i) {
        out.strand_first_point[i + 1] =
            out.strand_first_point[i] +
            static_cast<std::uint32_t>(groom.point_count(order.strand[i]));
    }
    out.strand_position.resize(3 * groom.position.size());
    out.strand_guide.resize(3 * n);
    out.strand_weight.resize(3 * n);
    out.strand_id.resize(n);
    out.strand_group.resize(n);
    if (!groom.radius.empty()) out.strand_radius.resize(n);
    if (boned) {
        out.strand_bone.resize(4 * n);
        out.strand_bone_weight.resize(4 * n);
    }
    if (bound) {
        out.strand_triangle.resize(n);
        out.strand_barycentric.resize(2 * n);
    }
    if (!roots.uv.empty()) out.strand_uv.resize(2 * n);
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t s = order.strand[i];
        const auto points = groom.points(s);
        std::size_t at = 3 * std::size_t{out.strand_first_point[i]};
        for (const Vec3& p : points) {
            for (int k = 0; k < 3; ++k) out.strand_position[at++] = to_float(p[k]);
        }
        for (std::size_t k = 0; k < 3; ++k) {
            out.strand_guide[3 * i + k] = order.lane_of[blends[s].guide[k]];
            out.strand_weight[3 * i + k] = to_float(blends[s].weight[k]);
        }
        out.strand_id[i] = groom.id[s];
        out.strand_group[i] = groom.group[s];
        if (!groom.radius.empty()) {
            const double radius = groom.radius[s].front();
            out.strand_radius[i] =
                radius > 0 ? to_float(radius) : groups[groom.group[s]].material.radius;
        }
        if (boned) {
            for (std::size_t k = 0; k < 4; ++k) {
                out.strand_bone[4 * i + k] = carriers.bone[s][k];
                out.strand_bone_weight[4 * i + k] = to_float(carriers.weight[s][k]);
            }
        }
        if (bound) {
            out.strand_triangle[i] = roots.triangle[s];
            out.strand_barycentric[2 * i] = to_float(roots.barycentric[s].x());
            out.strand_barycentric[2 * i + 1] = to_float(roots.barycentric[s].y());
        }
        if (!roots.uv.empty()) {
            out.strand_uv[2 * i] = to_float(roots.uv[s].x());
            out.strand_uv[2 * i + 1] = to_float(roots.uv[s].y());
        }
    }

    const std::size_t lanes = order.lane_strand.size();
    const std::size_t rows = order.tile_first_row.back();
    out.tile_first_row = order.tile_first_row;
    out.guide_group = order.lane_group;
    out.guide_point_count.assign(lanes, 0);
    out.guide_strand.assign(lanes, kNoStrand);
    out.guide_position.resize(3 * rows * kTileLanes);
    out.guide_length.resize(rows * kTileLanes);
    out.guide_shape.resize(3 * rows * kTileLanes);
    if (boned) {
        out.guide_bone.resize(4 * lanes);
        out.guide_bone_weight.resize(4 * lanes);
    }
    if (bound) {
        out.guide_triangle.resize(lanes);
        out.guide_barycentric.resize(2 * lanes);
    }
    // An empty lane repeats the last guide before it, in its own or an earlier tile of the quad.
    std::vector<std::uint32_t> shown = order.lane_strand;
    for (std::size_t i = 1; i < lanes; ++i) {
        if (shown[i] == kNoStrand) shown[i] = shown[i - 1];
    }
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < lanes; ++i) {
        const std::size_t tile = i / kTileLanes, lane = i % kTileLanes;
        const std::uint32_t s = shown[i];
        const auto strand = groom.points(s);
        const std::size_t count = strand.size();
        std::vector<double> points(3 * count), length(count), shape(3 * count);
        for (std::size_t p = 0; p < count; ++p) {
            for (std::size_t k = 0; k < 3; ++k) {
                points[3 * p + k] = to_float(strand[p][static_cast<int>(k)]);
            }
        }
        std::array<double, 3> normal{0, 1, 0};
        if (bound) {
            for (std::size_t k = 0; k < 3; ++k) normal[k] = roots.normal[s][static_cast<int>(k)];
        }
        rest_frames(points, normal, length, shape);
        if (order.lane_strand[i] != kNoStrand) {
            out.guide_point_count[i] = static_cast<std::uint32_t>(count);
            out.guide_strand[i] = order.new_strand[s];
        }
        const std::size_t first = order.tile_first_row[tile];
        const std::size_t tile_rows = order.tile_first_row[tile + 1] - first;
        for (std::size_t r = 0; r < tile_rows; ++r) {
            const std::size_t p = std::min(r, count - 1);
            const bool below_tip = r >= count;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t at = vector_index(first + r, 3, k, lane);
                out.guide_position[at] = to_float(points[3 * p + k]);
                out.guide_shape[at] = below_tip ? 0.0f : to_float(shape[3 * p + k]);
            }
            out.guide_length[scalar_index(first + r, lane)] =
                below_tip ? 0.0f : to_float(length[p]);
        }
        if (boned) {
            for (std::size_t k = 0; k < 4; ++k) {
                out.guide_bone[vector_index(tile, 4, k, lane)] = carriers.bone[s][k];
                out.guide_bone_weight[vector_index(tile, 4, k, lane)] =
                    to_float(carriers.weight[s][k]);
            }
        }
        if (bound) {
            out.guide_triangle[i] = roots.triangle[s];
            out.guide_barycentric[vector_index(tile, 2, 0, lane)] =
                to_float(roots.barycentric[s].x());
            out.guide_barycentric[vector_index(tile, 2, 1, lane)] =
                to_float(roots.barycentric[s].y());
        }
    }
}

Hash128 topology_hash(const RawMesh& mesh) {
    return hash_bytes(std::as_bytes(std::span(mesh.triangle)));
}

void store_mesh(const RawMesh* mesh, const Roots& roots, const Recipe& recipe, AssetInfo& info,
                AssetArrays& out) {
    if (mesh == nullptr) return;
    info.mesh_vertex_count = static_cast<std::uint32_t>(mesh->position.size());
    info.mesh_triangle_count = static_cast<std::uint32_t>(mesh->triangle.size());
    info.mesh_topology_hash = topology_hash(*mesh);
    const MeshKeep keep = recipe.mesh_keep != MeshKeep::automatic ? recipe.mesh_keep
                          : recipe.attach == Attach::triangle     ? MeshKeep::bound
                                                                  : MeshKeep::none;
    if (keep == MeshKeep::none) return;

    std::vector<std::uint8_t> used(mesh->position.size(), keep == MeshKeep::all);
    if (keep == MeshKeep::bound) {
        out.mesh_triangle_source = roots.triangle;
        std::sort(out.mesh_triangle_source.begin(), out.mesh_triangle_source.end());
        out.mesh_triangle_source.erase(
            std::unique(out.mesh_triangle_source.begin(), out.mesh_triangle_source.end()),
            out.mesh_triangle_source.end());
        for (std::uint32_t t : out.mesh_triangle_source) {
            for (std::uint32_t v : mesh->triangle[t]) used[v] = 1;
        }
    }
    std::vector<std::uint32_t> stored(mesh->position.size());
    std::uint32_t count = 0;
    for (std::size_t v = 0; v < mesh->position.size(); ++v) {
        if (!used[v]) continue;
        stored[v] = count++;
        for (int k = 0; k < 3; ++k) out.mesh_position.push_back(to_float(mesh->position[v][k]));
        if (!mesh->uv.empty()) {
            for (int k = 0; k < 2; ++k) out.mesh_uv.push_back(to_float(mesh->uv[v][k]));
        }
        if (keep == MeshKeep::bound) {
            out.mesh_vertex_source.push_back(static_cast<std::uint32_t>(v));
        }
    }
    const auto add = [&](std::uint32_t t) {
        for (std::uint32_t v : mesh->triangle[t]) out.mesh_triangle.push_back(stored[v]);
    };
    if (keep == MeshKeep::bound) {
        for (std::uint32_t t : out.mesh_triangle_source) add(t);
    } else {
        for (std::uint32_t t = 0; t < mesh->triangle.size(); ++t) add(t);
    }
    info.vertex_count = count;
    info.triangle_count = static_cast<std::uint32_t>(out.mesh_triangle.size() / 3);
}

}  // namespace keratin
