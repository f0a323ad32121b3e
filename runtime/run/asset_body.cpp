#include "runtime/run/asset_body.h"

#include "runtime/root_transform.h"
#include "schema/formula/frame.h"
#include "tools/measure/energy.h"

#include <algorithm>
#include <numbers>

namespace keratin {

namespace {

using measure::Point;

std::array<float, 3> to_float(Point p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

Point to_point(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

Result<std::vector<const Motion*>> match_bones(const SceneAsset& scene, const AssetInfo& info) {
    std::vector<const Motion*> out(info.bones.size());
    for (const BoneMotion& bone : scene.bones) {
        const auto found = std::find(info.bones.begin(), info.bones.end(), bone.bone);
        if (found == info.bones.end()) {
            std::string known;
            for (std::size_t b = 0; b < std::min<std::size_t>(info.bones.size(), 8); ++b)
                known += (b ? ", " : "") + info.bones[b];
            return Error{ErrorCode::input, scene.file,
                         "the pose file moves the bone `" + bone.bone +
                             "`, which the asset has "
                             "not; " +
                             (info.bones.empty() ? std::string("it has no bones")
                                                 : "it has " + std::to_string(info.bones.size()) +
                                                       " bones: " + known +
                                                       (info.bones.size() > 8 ? ", ..." : ""))};
        }
        out[static_cast<std::size_t>(found - info.bones.begin())] = &bone.motion;
    }
    return out;
}

// Adds the points of the guide's unloaded shape, the first segment as at rest: the rest edges, each
// in the frame of the one before (METHODS 1.4).
void add_unloaded(const AssetFields& fields, std::uint32_t lane, std::vector<Point>& out) {
    const auto vector = [&](std::span<const float> field, std::uint32_t p) {
        const Point v = guide_point(field, fields, lane, p);
        return Vec3<double>(v.x, v.y, v.z);
    };
    Vec3<double> x = vector(fields.guide_position, 0);
    Vec3<double> t = normalize_or(vector(fields.guide_position, 1) - x, Vec3<double>(0, 1, 0));
    Vec3<double> u = orthonormal_director(t, vector(fields.guide_shape, 0));
    out.push_back({x.x, x.y, x.z});
    for (std::uint32_t p = 1; p < fields.guide_point_count[lane]; ++p) {
        const Vec3<double> c = vector(fields.guide_shape, p), e = from_frame(t, u, c);
        x += e;
        out.push_back({x.x, x.y, x.z});
        const Vec3<double> next = normalize_or(e, t);
        u = transport_director(t, next, u);
        t = next;
    }
}

// Vertices that the asset stores, at a time: asset space, m.
void stored_vertices(const AssetBody& body, double time, std::vector<double>& out) {
    const AssetFields& fields = body.asset.fields();
    out.assign(fields.mesh_position.begin(), fields.mesh_position.end());
    if (body.mesh.empty()) return;
    std::vector<double> mesh;
    body.mesh.at(time, mesh);
    for (std::size_t v = 0; v < out.size() / 3; ++v) {
        const std::size_t source =
            fields.mesh_vertex_source.empty() ? v : fields.mesh_vertex_source[v];
        for (std::size_t c = 0; c < 3; ++c) out[3 * v + c] = mesh[3 * source + c];
    }
}

}  // namespace

Result<AssetBody> open_body(const SceneAsset& scene) {
    auto view = AssetView::open(scene.file);
    if (!view) return view.error();
    auto bones = match_bones(scene, view->info());
    if (!bones) return bones.error();
    MeshFrames mesh;
    if (!scene.mesh_frames.empty()) {
        if (view->info().mesh_vertex_count == 0)
            return Error{ErrorCode::input, scene.file,
                         "the scene moves the mesh, but the asset was not bound to one"};
        auto frames = read_mesh_frames(scene, view->info());
        if (!frames) return frames.error();
        mesh = std::move(*frames);
    }
    return AssetBody{&scene, std::move(*view), std::move(*bones), std::move(mesh), {}, 0, 0, 0};
}

Point guide_point(std::span<const float> rows, const AssetFields& fields, std::uint32_t lane,
                  std::uint32_t p) {
    const std::size_t row = fields.tile_first_row[lane / kTileLanes] + p, l = lane % kTileLanes;
    return {rows[vector_index(row, 3, 0, l)], rows[vector_index(row, 3, 1, l)],
            rows[vector_index(row, 3, 2, l)]};
}

void skip_guides(AssetBody& body, const RunLayout& layout) {
    body.first_guide = static_cast<std::uint32_t>(layout.head.guide_lane.size());
    body.first_guide_point = layout.head.guide_first_point.back();
}

RunLayout empty_layout(const Scene& scene, const RunOptions& options, const char* solver) {
    RunLayout out;
    out.head.tool_version = options.tool_version;
    out.head.solver = solver;
    out.head.scene = scene.file;
    out.head.frame = scene.frame;
    out.head.guide_first_point = {0};
    out.head.strand_first_point = {0};
    return out;
}

void add_guides(AssetBody& body, std::uint32_t held, RunLayout& layout) {
    const AssetInfo& info = body.asset.info();
    const AssetFields& fields = body.asset.fields();
    CacheHead& head = layout.head;
    skip_guides(body, layout);
    for (std::uint32_t lane = 0; lane < fields.guide_point_count.size(); ++lane)
        if (fields.guide_point_count[lane] > 0) body.lanes.push_back(lane);

    for (std::size_t g = 0; g < body.lanes.size(); ++g) {
        const std::uint32_t lane = body.lanes[g];
        const GroupInfo& group = info.groups[fields.guide_group[lane]];
        const double r1 = group.material.radius, r2 = group.material.radius2;
        const double area = std::numbers::pi * r1 * r2;
        for (std::uint32_t p = 0; p < body.guide_points(g); ++p)
            layout.rest.push_back(guide_point(fields.guide_position, fields, lane, p));
        add_unloaded(fields, lane, layout.unloaded);
        head.guide_lane.push_back(lane);
        head.guide_first_point.push_back(static_cast<std::uint32_t>(layout.rest.size()));
        layout.stretch_stiffness.push_back(group.material.youngs_modulus * area);
        // The mean of both axes' EI: the strand solver has no twist to tell them apart.
        layout.bend_stiffness.push_back(group.material.youngs_modulus * area * (r1 * r1 + r2 * r2) /
                                        8);
        layout.held_points.push_back(held);
        layout.degrees_of_freedom +=
            3u * (body.guide_points(g) - std::min(held, body.guide_points(g)));
        const std::vector<std::uint32_t> first{
            0, head.guide_first_point.back() - head.guide_first_point[head.guide_lane.size() - 1]};
        const std::vector<double> line_density{group.material.density * area};
        const auto mass =
            measure::lumped_masses({first, std::span(layout.rest).last(first[1])}, line_density);
        layout.mass.insert(layout.mass.end(), mass.begin(), mass.end());
    }
}

void add_render_strands(AssetBody& body, std::uint32_t count, RunLayout& layout) {
    const AssetInfo& info = body.asset.info();
    const AssetFields& fields = body.asset.fields();
    CacheHead& head = layout.head;
    const std::uint32_t first_point = head.strand_first_point.back();
    body.strand_count = count;
    for (std::uint32_t s = 0; s < count; ++s) {
        head.strand_first_point.push_back(first_point + fields.strand_first_point[s + 1]);
        head.strand_radius.push_back(fields.strand_radius.empty()
                                         ? info.groups[fields.strand_group[s]].material.radius
                                         : fields.strand_radius[s]);
        layout.id.push_back(fields.strand_id[s]);
        if (!fields.strand_uv.empty()) {
            layout.uv.push_back(fields.strand_uv[2 * s]);
            layout.uv.push_back(fields.strand_uv[2 * s + 1]);
        }
    }
    // Texture coordinates are of all strands or of none.
    if (layout.uv.size() != 2 * layout.id.size()) layout.uv.clear();
    const std::size_t before =
        head.assets.empty() ? 0 : head.assets.back().first_strand + head.assets.back().strand_count;
    head.assets.push_back({body.scene->file, info.file_hash, body.first_guide,
                           static_cast<std::uint32_t>(body.lanes.size()),
                           static_cast<std::uint32_t>(before), body.strand_count});
}

std::vector<RigidTransform> bones_at(const AssetBody& body, double time) {
    std::vector<RigidTransform> out(body.bones.size());
    for (std::size_t b = 0; b < out.size(); ++b)
        if (body.bones[b]) out[b] = pose_at(*body.bones[b], time);
    return out;
}

Result<void> set_body_inputs(const AssetBody& body, double time, Simulation& simulation) {
    const auto refuse = [&](const Result<void>& result) {
        return Error{result.error().code, body.scene->file, result.error().message};
    };
    if (auto ok = simulation.set_motion(pose_at(body.scene->motion, time)); !ok) return refuse(ok);
    if (!body.scene->bones.empty())
        if (auto ok = simulation.set_bones(bones_at(body, time)); !ok) return refuse(ok);
    if (!body.mesh.empty()) {
        std::vector<float> mesh;
        body.mesh.at(time, mesh);
        if (auto ok = simulation.set_mesh(mesh); !ok) return refuse(ok);
    }
    return {};
}

void guide_roots(const AssetBody& body, double time, std::vector<RigidTransform>& out) {
    const AssetInfo& info = body.asset.info();
    const AssetFields& fields = body.asset.fields();
    const RigidTransform motion = pose_at(body.scene->motion, time);
    out.assign(body.lanes.size(), motion);
    const bool by_triangle = info.attach == Attach::triangle;
    if (!by_triangle && info.bones.empty()) return;
    std::vector<double> mesh;
    if (by_triangle) stored_vertices(body, time, mesh);
    std::vector<RigidTransform> bones = bones_at(body, time);
    for (RigidTransform& bone : bones) bone = chained(motion, bone);
    constexpr std::array<double, 3> kWorld{0, 0, 0};
    for (std::size_t g = 0; g < body.lanes.size(); ++g) {
        const std::uint32_t lane = body.lanes[g];
        const std::size_t tile = lane / kTileLanes, l = lane % kTileLanes;
        const Point root = guide_point(fields.guide_position, fields, lane, 0);
        const Vec3d rest(root.x, root.y, root.z);
        RootTransform<double> carried;
        if (by_triangle) {
            const std::uint32_t slot = stored_triangle(fields, fields.guide_triangle[lane]);
            carried = triangle_root<double>(
                fields.mesh_triangle.data() + std::size_t{slot} * 3, fields.mesh_position, mesh,
                fields.guide_barycentric[vector_index(tile, 2, 0, l)],
                fields.guide_barycentric[vector_index(tile, 2, 1, l)], motion, kWorld, rest);
        } else {
            std::uint32_t bone[4];
            float weight[4];
            for (std::size_t k = 0; k < 4; ++k) {
                bone[k] = fields.guide_bone[vector_index(tile, 4, k, l)];
                weight[k] = fields.guide_bone_weight[vector_index(tile, 4, k, l)];
            }
            carried = bone_root<double>(bones, kWorld, bone, weight, rest);
        }
        out[g] = transform_of(carried.rotation, carried.translation);
    }
}

CacheTransform to_cache(const RigidTransform& m) { return {m.translation, m.rotation}; }

CacheBody cache_body(const AssetBody& body, double time) {
    const AssetFields& fields = body.asset.fields();
    const RigidTransform motion = pose_at(body.scene->motion, time);
    CacheBody out{to_cache(motion), {}, {}};
    for (const RigidTransform& bone : bones_at(body, time)) out.bones.push_back(to_cache(bone));
    if (body.mesh.empty() || fields.mesh_position.empty()) return out;
    std::vector<float> mesh;
    body.mesh.at(time, mesh);
    const std::size_t count = fields.mesh_position.size() / 3;
    for (std::size_t v = 0; v < count; ++v) {
        const std::size_t source =
            fields.mesh_vertex_source.empty() ? v : fields.mesh_vertex_source[v];
        const Point p = measure::apply(
            to_rigid(motion), {mesh[3 * source], mesh[3 * source + 1], mesh[3 * source + 2]});
        for (const float c : to_float(p)) out.mesh_position.push_back(c);
    }
    return out;
}

std::vector<CacheCollider> cache_asset_colliders(const AssetBody& body, double time) {
    const RigidTransform motion = pose_at(body.scene->motion, time);
    const std::vector<RigidTransform> bones = bones_at(body, time);
    std::vector<CacheCollider> out;
    for (const AssetCollider& collider : body.asset.info().colliders) {
        const measure::Rigid m =
            to_rigid(bones.empty() ? motion : chained(motion, bones[collider.bone]));
        const auto at = [&](const std::array<float, 3>& p) {
            return to_float(measure::apply(m, to_point(p)));
        };
        out.push_back(
            {CacheShape::capsule, at(collider.a), at(collider.b), collider.radius, {0, 0, 0, 1}});
    }
    return out;
}

}  // namespace keratin
