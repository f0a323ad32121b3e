#include "runtime/run/statistics.h"

#include "runtime/run/mesh_frames.h"
#include "tools/measure/energy.h"
#include "tools/measure/shape.h"
#include "tools/measure/solid.h"
#include "tools/measure/strand_distance.h"

#include <algorithm>
#include <cmath>

namespace keratin {

namespace {

using measure::Point;
using Json = nlohmann::ordered_json;

// Neighbours are points of other strands within this share of the groom's size at rest; the density
// grid's cells are as large.
constexpr double kNeighbourShare = 1.0 / 40;
constexpr double kDensityPercentile = 99;

Point to_point(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

bool is_finite(const Point& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

double size_of(std::span<const Point> points) {
    if (points.empty()) return 0;
    Point low = points[0], high = low;
    for (const Point& p : points) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    return measure::distance(low, high);
}

// The strand of `lane` at a fraction of its rest length, linear between points.
struct GuideLine {
    std::span<const Point> position, rest;

    Point at(double fraction) const {
        double total = 0;
        for (std::size_t p = 1; p < rest.size(); ++p)
            total += measure::distance(rest[p], rest[p - 1]);
        double left = fraction * total;
        for (std::size_t p = 1; p < rest.size(); ++p) {
            const double l = measure::distance(rest[p], rest[p - 1]);
            if (left <= l && l > 0)
                return position[p - 1] + (position[p] - position[p - 1]) * (left / l);
            left -= l;
        }
        return position.back();
    }
};

// Distance of x from the surface of a collider, m, negative inside.
double distance_to(const CacheCollider& collider, Point x) {
    const Point a = to_point(collider.a), b = to_point(collider.b);
    switch (collider.shape) {
        case CacheShape::plane:
            return measure::signed_distance(measure::Plane{a, b}, x);
        case CacheShape::sphere:
        case CacheShape::capsule:
            return measure::signed_distance(measure::Capsule{a, b, collider.radius}, x);
        case CacheShape::box:
            break;
    }
    const auto& q = collider.rotation;
    const measure::Rigid pose{a, q[0], q[1], q[2], q[3]};
    return measure::signed_distance(measure::Box{{}, b}, measure::apply_inverse(pose, x));
}

}  // namespace

Result<std::unique_ptr<Statistics>> Statistics::create(const Scene& scene, const SolverRun& run) {
    auto out = std::make_unique<Statistics>();
    out->scene_ = &scene;
    out->layout_ = &run.layout();
    const RunLayout& layout = run.layout();
    const CacheHead& head = layout.head;
    for (const CacheAsset& share : head.assets) {
        auto view = AssetView::open(share.file, Verify::structure);
        if (!view) return view.error();
        Body body;
        body.asset = std::make_unique<AssetView>(std::move(*view));
        body.first_point = head.guide_first_point[share.first_guide];
        const std::size_t end = head.guide_first_point[share.first_guide + share.guide_count];
        body.rest.assign(layout.rest.begin() + static_cast<std::ptrdiff_t>(body.first_point),
                         layout.rest.begin() + static_cast<std::ptrdiff_t>(end));
        const AssetFields& fields = body.asset->fields();
        if (!fields.mesh_triangle.empty() && !body.rest.empty()) {
            std::vector<Point> vertices;
            for (std::size_t v = 0; v + 2 < fields.mesh_position.size(); v += 3)
                vertices.push_back({fields.mesh_position[v], fields.mesh_position[v + 1],
                                    fields.mesh_position[v + 2]});
            for (std::size_t t = 0; t + 2 < fields.mesh_triangle.size(); t += 3)
                body.triangles.push_back({fields.mesh_triangle[t], fields.mesh_triangle[t + 1],
                                          fields.mesh_triangle[t + 2]});
            body.mesh = std::make_unique<measure::MeshDistance>(vertices, body.triangles);
            body.tracker = std::make_unique<measure::PenetrationTracker>(*body.mesh, body.rest);
            body.rest_depth.assign(body.tracker->rest_depth().begin(),
                                   body.tracker->rest_depth().end());
            out->has_mesh_ = true;
        }
        out->bodies_.push_back(std::move(body));
    }
    for (const SceneCollider& collider : scene.colliders) {
        const auto* shape = std::get_if<MeshShape>(&collider.shape);
        if (!shape) continue;
        auto read = read_obj_triangles(shape->file);
        if (!read) return read.error();
        std::vector<Point> vertices;
        for (const auto& p : read->position) vertices.push_back({p[0], p[1], p[2]});
        out->collider_meshes_.push_back(
            {std::make_unique<measure::MeshDistance>(vertices, read->triangle), &collider});
    }
    out->spacing_ = size_of(layout.rest) * kNeighbourShare;
    if (out->spacing_ > 0)
        out->neighbours_ =
            measure::neighbours({head.guide_first_point, layout.rest}, out->spacing_);
    return out;
}

double Statistics::mesh_penetration(const RunState& state) {
    double deepest = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Body& body = bodies_[b];
        if (!body.mesh) continue;
        const auto position = std::span(state.position).subspan(body.first_point, body.rest.size());
        const CacheBody& where = state.bodies[b];
        if (where.mesh_position.empty()) {
            const CacheTransform& m = where.motion;
            const measure::Rigid pose{{m.translation[0], m.translation[1], m.translation[2]},
                                      m.rotation[0],
                                      m.rotation[1],
                                      m.rotation[2],
                                      m.rotation[3]};
            std::vector<Point> local;
            for (const Point& x : position) local.push_back(measure::apply_inverse(pose, x));
            deepest = std::max(deepest, body.tracker->measure(local).deeper);
        } else {
            std::vector<Point> vertices;
            for (std::size_t v = 0; v + 2 < where.mesh_position.size(); v += 3)
                vertices.push_back({where.mesh_position[v], where.mesh_position[v + 1],
                                    where.mesh_position[v + 2]});
            const measure::MeshDistance mesh(vertices, body.triangles);
            for (std::size_t p = 0; p < position.size(); ++p)
                deepest =
                    std::max(deepest, -mesh.signed_distance(position[p]) - body.rest_depth[p]);
        }
    }
    return deepest;
}

double Statistics::distance_kept(const SceneCollider& collider, std::size_t strand) const {
    if (layout_->thickness.empty()) return 0;
    return collider.contact_distance > 0 ? collider.contact_distance : layout_->thickness[strand];
}

double Statistics::collider_penetration(double time, const RunState& state) const {
    double deepest = 0;
    const auto each_free_point = [&](auto&& visit) {
        const auto& first = layout_->head.guide_first_point;
        for (std::size_t s = 0; s + 1 < first.size(); ++s)
            for (std::size_t p = first[s] + layout_->held_points[s]; p < first[s + 1]; ++p)
                visit(s, state.position[p]);
    };
    // Those with a formula come in the scene's order.
    std::size_t solids = 0;
    for (const SceneCollider& collider : scene_->colliders) {
        if (std::holds_alternative<MeshShape>(collider.shape)) continue;
        const CacheCollider& solid = state.colliders[solids++];
        each_free_point([&](std::size_t s, const Point& x) {
            deepest = std::max(deepest, distance_kept(collider, s) - distance_to(solid, x));
        });
    }
    for (const ColliderMesh& mesh : collider_meshes_) {
        const measure::Rigid pose = to_rigid(pose_at(mesh.collider->motion, time));
        each_free_point([&](std::size_t s, const Point& x) {
            const double away = mesh.mesh->signed_distance(measure::apply_inverse(pose, x));
            deepest = std::max(deepest, distance_kept(*mesh.collider, s) - away);
        });
    }
    return deepest;
}

// Between strands that have a thickness, whether or not contact is on.
double Statistics::strand_penetration(const RunState& state) const {
    return measure::overlap_between({layout_->head.guide_first_point, state.position},
                                    layout_->thickness, scene_->contact_distance, 0)
        .depth;
}

double Statistics::interpolation_distance(const RunState& state) const {
    const CacheHead& head = layout_->head;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const CacheAsset& share = head.assets[b];
        const AssetFields& fields = bodies_[b].asset->fields();
        for (std::uint32_t g = share.first_guide; g < share.first_guide + share.guide_count; ++g) {
            const std::uint32_t strand = fields.guide_strand[head.guide_lane[g]];
            if (strand >= share.strand_count) continue;
            const std::size_t first = head.guide_first_point[g],
                              points = head.guide_first_point[g + 1] - first;
            const GuideLine line{std::span(state.position).subspan(first, points),
                                 std::span(layout_->rest).subspan(first, points)};
            const std::uint32_t begin = fields.strand_first_point[strand],
                                end = fields.strand_first_point[strand + 1];
            const std::size_t offset = head.strand_first_point[share.first_strand];
            for (std::uint32_t p = begin; p < end; ++p) {
                const double fraction = !fields.strand_fraction.empty()
                                            ? fields.strand_fraction[p]
                                            : (p - begin) / std::max(1.0, end - begin - 1.0);
                const float* x = &state.strand_position[3 * (offset + p)];
                sum += measure::distance({x[0], x[1], x[2]}, line.at(fraction));
                ++count;
            }
        }
    }
    return count ? sum / static_cast<double>(count) : 0;
}

void Statistics::add_frame(double time, const RunState& state) {
    const RunLayout& layout = *layout_;
    const measure::Strands strands{layout.head.guide_first_point, state.position};
    const measure::Strands rest{layout.head.guide_first_point, layout.rest};
    const measure::Strands unloaded{layout.head.guide_first_point,
                                    layout.unloaded.empty() ? layout.rest : layout.unloaded};
    const measure::Strands rigid{layout.head.guide_first_point, state.rigid};
    finite_ = finite_ && std::all_of(state.position.begin(), state.position.end(), is_finite) &&
              std::all_of(state.strand_position.begin(), state.strand_position.end(),
                          [](float x) { return std::isfinite(x); });
    series_["time"].push_back(time);
    if (!finite_) return;

    const double stretch = measure::stretch(strands, rest).max;
    const double tip_lag = measure::tip_lag(strands, rigid).max;
    max_stretch_ = std::max(max_stretch_, stretch);
    max_tip_lag_ = std::max(max_tip_lag_, tip_lag);
    series_["stretch"].push_back(stretch);
    series_["tip_lag"].push_back(tip_lag);
    series_["pose_distance"].push_back(measure::point_distance(state.position, state.rigid).mean);
    if (has_mesh_) {
        const double deeper = mesh_penetration(state);
        max_mesh_ = std::max(max_mesh_, deeper);
        series_["mesh_penetration"].push_back(deeper);
    }
    if (!scene_->colliders.empty()) {
        const double depth = collider_penetration(time, state);
        max_collider_ = std::max(max_collider_, depth);
        series_["collider_penetration"].push_back(depth);
    }
    if (!layout.thickness.empty()) {
        const double depth = strand_penetration(state);
        max_strand_ = std::max(max_strand_, depth);
        series_["strand_penetration"].push_back(depth);
    }
    series_["relative_speed"].push_back(measure::relative_speed(neighbours_, state.velocity));
    if (spacing_ > 0)
        series_["density_p99"].push_back(
            measure::density_percentile(state.position, layout.mass, spacing_, kDensityPercentile));
    if (!bodies_.empty())
        series_["interpolation_distance"].push_back(interpolation_distance(state));

    const Point gravity{scene_->gravity[0], scene_->gravity[1], scene_->gravity[2]};
    const double elastic =
        state.elastic ? *state.elastic
                      : measure::stretch_energy(strands, rest, layout.stretch_stiffness) +
                            measure::bend_energy(strands, unloaded, state.root, layout.bend_stiffness);
    energy_.push_back(
        {{"time", time},
         {"kinetic", measure::kinetic_energy(layout.mass, state.velocity)},
         {"elastic", elastic},
         {"potential", measure::potential_energy(layout.mass, state.position, gravity)}});
}

Json Statistics::document(const SolverRun& run, const Schedule& schedule, int threads) const {
    const RunLayout& layout = *layout_;
    Json out;
    out["program"] = "keratin-run";
    out["version"] = layout.head.tool_version;
    out["solver"] = layout.head.solver;
    out["backend"] = "cpu";
    out["threads"] = threads;
    out["steps"] = schedule.step_count;
    out["frames"] = schedule.frame_count();
    out["strands"] = layout.head.guide_lane.size();
    out["points"] = layout.rest.size();
    out["degrees_of_freedom"] = layout.degrees_of_freedom;
    out["render_strands"] = layout.head.strand_radius.size();
    out["render_points"] = layout.head.strand_first_point.back();
    out["bytes"] = {{"total", 0}};
    out["seconds"] = {{"total", 0}};
    out["finite"] = finite_;
    out["max_stretch"] = max_stretch_;
    out["max_tip_lag"] = max_tip_lag_;
    out["max_penetration"] = std::max({max_mesh_, max_collider_, max_strand_});
    out["penetration"] = {{"mesh", has_mesh_ ? Json(max_mesh_) : Json()},
                          {"colliders", scene_->colliders.empty() ? Json() : Json(max_collider_)},
                          {"strands", layout.thickness.empty() ? Json() : Json(max_strand_)}};
    for (const char* key : {"contacts_mean", "contacts_max", "iterations_mean", "steps_at_cap",
                            "steps_halved", "coulomb_residual"})
        out[key] = nullptr;
    out["energy"] = energy_;
    out["series"] = series_;
    out["health"] = Json::object();
    run.statistics(out);
    out["hash"] = run.hash();
    return out;
}

Json points_by_strand(std::span<const std::uint32_t> first_point, std::span<const Point> points) {
    Json out = Json::array();
    for (std::size_t s = 0; s + 1 < first_point.size(); ++s) {
        Json strand = Json::array();
        for (std::uint32_t p = first_point[s]; p < first_point[s + 1]; ++p)
            strand.push_back({points[p].x, points[p].y, points[p].z});
        out.push_back(std::move(strand));
    }
    return out;
}

}  // namespace keratin
