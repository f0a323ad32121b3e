// The `strand` solver over the assets of a scene: one Simulation an asset.
#include "runtime/run/asset_body.h"
#include "runtime/run/motion.h"
#include "runtime/run/solver_run.h"
#include "runtime/simulation.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace keratin {

namespace {

using measure::Point;

std::array<float, 3> to_float(const Double3& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

std::array<float, 3> to_float(Point p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

Point to_point(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// A shape of the scene as the solver takes it.
struct ToCollider {
    const std::string& path;
    Result<ColliderShape> operator()(const PlaneShape& s) const {
        Double3 n = s.normal;
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (double& c : n) c /= length;
        return ColliderShape(PlaneCollider{to_float(s.point), to_float(n)});
    }
    Result<ColliderShape> operator()(const SphereShape& s) const {
        return ColliderShape(SphereCollider{to_float(s.center), static_cast<float>(s.radius)});
    }
    Result<ColliderShape> operator()(const CapsuleShape& s) const {
        return ColliderShape(
            CapsuleCollider{to_float(s.a), to_float(s.b), static_cast<float>(s.radius)});
    }
    Result<ColliderShape> operator()(const BoxShape& s) const {
        return ColliderShape(BoxCollider{to_float(s.center), to_float(s.half_size)});
    }
    Result<ColliderShape> operator()(const MeshShape&) const { return refuse("mesh"); }
    Result<ColliderShape> operator()(const DistanceGridShape&) const {
        return refuse("distance_grid");
    }
    Error refuse(const char* shape) const {
        return {ErrorCode::unsupported, path,
                std::string("the strand solver does not take a ") + shape +
                    " from a scene; use sphere, capsule, box or plane, or let the bake fit "
                    "colliders (\"colliders\": \"fit\" in the recipe)"};
    }
};

Result<Settings> to_settings(const Scene& scene, const SceneAsset& asset,
                             const RunOptions& options) {
    Settings out;
    out.gravity = to_float(scene.gravity);
    out.wind = {to_float(scene.wind.velocity), static_cast<float>(scene.wind.gust),
                static_cast<float>(scene.wind.turbulence)};
    out.seed = scene.seed;
    out.threads = options.threads;
    out.lod = static_cast<float>(asset.lod);
    const SceneSettings& in = scene.settings;
    if (in.iterations) out.iterations = static_cast<std::uint32_t>(*in.iterations);
    out.passes.grid_friction = in.grid_friction.value_or(true);
    out.passes.grid_volume = in.grid_volume.value_or(true);
    out.passes.stretch = in.stretch.value_or(true);
    out.passes.local_shape = in.local_shape.value_or(true);
    out.passes.global_length = in.global_length.value_or(true);
    out.passes.collision = in.collision.value_or(true);
    out.passes.interpolation = in.interpolation.value_or(true);
    for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
        const SceneCollider& collider = scene.colliders[i];
        const std::string path = scene.file + ": colliders[" + std::to_string(i) + "]";
        auto shape = std::visit(ToCollider{path}, collider.shape);
        if (!shape) return shape.error();
        out.colliders.push_back({*shape, static_cast<float>(collider.friction),
                                 static_cast<float>(collider.contact_distance),
                                 pose_at(collider.motion, 0)});
    }
    return out;
}

// One asset with its simulation.
struct Body : AssetBody {
    Simulation simulation;
};

class StrandRun final : public SolverRun {
  public:
    Scene scene_;
    std::vector<Body> bodies_;
    RunLayout layout_;

    Result<void> set_up(const RunOptions& options) {
        layout_ = empty_layout(scene_, options, "strand");
        for (const SceneAsset& asset : scene_.assets)
            if (auto ok = add_body(asset, options); !ok) return ok;
        return set_inputs(0, true);
    }

    const RunLayout& layout() const override { return layout_; }

    std::string explain() const override {
        std::string out;
        for (const Body& body : bodies_) {
            if (bodies_.size() > 1) out += body.scene->file + "\n";
            out += keratin::explain(body.simulation.plan());
        }
        return out;
    }

    void plan(nlohmann::ordered_json& out) const override {
        out = nlohmann::ordered_json::array();
        for (const Body& body : bodies_) {
            const SolverPlan& plan = body.simulation.plan();
            const auto none = nlohmann::ordered_json::array();
            nlohmann::ordered_json entry{{"asset", body.scene->file},
                                         {"passes", none},
                                         {"buffers", none},
                                         {"left_out", none}};
            for (const PlannedPass& pass : plan.passes) {
                auto buffers = nlohmann::ordered_json::array();
                for (const BufferId buffer : pass.buffers) buffers.push_back(name_of(buffer));
                entry["passes"].push_back({{"name", name_of(pass.id)}, {"buffers", buffers}});
            }
            for (const PlannedBuffer& buffer : plan.buffers)
                entry["buffers"].push_back({{"name", name_of(buffer.id)}, {"bytes", buffer.bytes}});
            for (const LeftOut& left : plan.left_out)
                entry["left_out"].push_back({{"name", left.name}, {"reason", left.reason}});
            out.push_back(std::move(entry));
        }
    }

    Result<void> step(double t0, double t1) override {
        if (auto ok = set_inputs(t1, false); !ok) return ok;
        for (Body& body : bodies_)
            if (auto ok = body.simulation.step(t1 - t0); !ok)
                return Error{ok.error().code, scene_.file, ok.error().message};
        return {};
    }

    void look(RunState& out) const override;
    void statistics(nlohmann::ordered_json& out) const override;

    std::string hash() const override {
        // FNV-1a over the simulations' hashes, in the order of the assets.
        std::uint64_t hash = 0xcbf29ce484222325u;
        for (const Body& body : bodies_)
            hash = (hash ^ body.simulation.position_hash()) * 0x100000001b3u;
        char text[17];
        std::snprintf(text, sizeof text, "%016llx",
                      static_cast<unsigned long long>(
                          bodies_.size() == 1 ? bodies_[0].simulation.position_hash() : hash));
        return text;
    }

    Result<std::vector<std::byte>> save() const override {
        std::vector<std::byte> out;
        for (const Body& body : bodies_) {
            const std::vector<std::byte> state = body.simulation.save();
            const std::uint64_t size = state.size();
            const auto bytes = std::as_bytes(std::span(&size, 1));
            out.insert(out.end(), bytes.begin(), bytes.end());
            out.insert(out.end(), state.begin(), state.end());
        }
        return out;
    }

    Result<void> load(std::span<const std::byte> state, double) override {
        for (Body& body : bodies_) {
            std::uint64_t size = 0;
            if (state.size() >= sizeof size) std::memcpy(&size, state.data(), sizeof size);
            if (state.size() < sizeof size || size > state.size() - sizeof size)
                return Error{ErrorCode::input, "", "the state is of another scene"};
            if (auto ok = body.simulation.load(state.subspan(sizeof size, size)); !ok) return ok;
            state = state.subspan(sizeof size + size);
        }
        if (!state.empty()) return Error{ErrorCode::input, "", "the state is of another scene"};
        return {};
    }

  private:
    Result<void> add_body(const SceneAsset& asset, const RunOptions& options);
    Result<void> set_inputs(double time, bool first);
};

Result<void> StrandRun::add_body(const SceneAsset& scene, const RunOptions& options) {
    auto body = open_body(scene);
    if (!body) return body.error();
    auto settings = to_settings(scene_, scene, options);
    if (!settings) return settings.error();
    auto simulation = Simulation::create(body->asset, *settings);
    if (!simulation)
        return Error{simulation.error().code,
                     simulation.error().where.empty() ? scene.file : simulation.error().where,
                     simulation.error().message};
    bodies_.push_back(Body{std::move(*body), std::move(*simulation)});
    Body& added = bodies_.back();
    const bool by_triangle = added.asset.info().attach == Attach::triangle;
    if (added.simulation.guides().position.empty())
        skip_guides(added, layout_);
    else
        add_guides(added, by_triangle ? 1 : 2, layout_);
    add_render_strands(added, added.simulation.strands().strand_count, layout_);
    return {};
}

Result<void> StrandRun::set_inputs(double time, bool first) {
    for (Body& body : bodies_) {
        if (auto ok = set_body_inputs(body, time, body.simulation); !ok) return ok;
        for (std::size_t c = 0; c < scene_.colliders.size(); ++c)
            if (auto ok =
                    body.simulation.set_collider(c, pose_at(scene_.colliders[c].motion, time));
                !ok)
                return Error{ok.error().code, body.scene->file, ok.error().message};
        if (first) body.simulation.reset();
    }
    return {};
}

CacheCollider to_cache(const ColliderShape& shape, const RigidTransform& motion) {
    const measure::Rigid m = to_rigid(motion);
    const auto at = [&](const std::array<float, 3>& p) {
        return to_float(measure::apply(m, to_point(p)));
    };
    CacheCollider out;
    if (const auto* sphere = std::get_if<SphereCollider>(&shape)) {
        out = {CacheShape::sphere,
               at(sphere->center),
               at(sphere->center),
               sphere->radius,
               {0, 0, 0, 1}};
    } else if (const auto* capsule = std::get_if<CapsuleCollider>(&shape)) {
        out = {CacheShape::capsule, at(capsule->a), at(capsule->b), capsule->radius, {0, 0, 0, 1}};
    } else if (const auto* box = std::get_if<BoxCollider>(&shape)) {
        const auto& q = motion.rotation;
        out = {CacheShape::box,
               at(box->center),
               box->half_size,
               0,
               {static_cast<float>(q[0]), static_cast<float>(q[1]), static_cast<float>(q[2]),
                static_cast<float>(q[3])}};
    } else if (const auto* plane = std::get_if<PlaneCollider>(&shape)) {
        out = {CacheShape::plane,
               at(plane->point),
               to_float(measure::turn(m, to_point(plane->normal))),
               0,
               {0, 0, 0, 1}};
    }
    return out;
}

void StrandRun::look(RunState& out) const {
    out = {};
    const double now = bodies_.empty() ? 0 : bodies_[0].simulation.time();
    for (std::size_t c = 0; c < scene_.colliders.size(); ++c)
        out.colliders.push_back(to_cache(bodies_[0].simulation.settings().colliders[c].shape,
                                         pose_at(scene_.colliders[c].motion, now)));
    out.scene_colliders = out.colliders.size();
    for (const Body& body : bodies_) {
        const AssetFields& fields = body.asset.fields();
        const GuideView guides = body.simulation.guides();
        for (std::size_t g = 0; g < body.lanes.size(); ++g) {
            const measure::Rigid root = to_rigid(body.simulation.guide_root(body.lanes[g]));
            out.root.push_back(root);
            for (std::uint32_t p = 0; p < body.guide_points(g); ++p) {
                const Point x = guide_point(guides.position, fields, body.lanes[g], p);
                const Point before = guide_point(guides.previous, fields, body.lanes[g], p);
                out.position.push_back(x);
                out.velocity.push_back(
                    guides.previous_step > 0 ? (x - before) * (1 / guides.previous_step) : Point{});
                out.rigid.push_back(measure::apply(root, layout_.rest[out.position.size() - 1]));
            }
        }
        const StrandView strands = body.simulation.strands();
        const std::size_t points = fields.strand_first_point[body.strand_count];
        out.strand_position.insert(
            out.strand_position.end(), strands.position.begin(),
            strands.position.begin() + static_cast<std::ptrdiff_t>(3 * points));

        out.bodies.push_back(cache_body(body, now));
        // A distance grid takes the place of the fitted shapes (asset_collider_count).
        if (!body.simulation.settings().asset_colliders ||
            body.asset.info().distance_grid.stored_bricks > 0)
            continue;
        for (const CacheCollider& collider : cache_asset_colliders(body, now))
            out.colliders.push_back(collider);
    }
}

void StrandRun::statistics(nlohmann::ordered_json& out) const {
    std::uint64_t total = 0;
    double seconds = 0;
    HealthCounters health;
    nlohmann::ordered_json bytes = nlohmann::ordered_json::object(), passes = bytes;
    for (const Body& body : bodies_) {
        for (const PlannedBuffer& buffer : body.simulation.plan().buffers) {
            const std::string name(name_of(buffer.id));
            bytes[name] = bytes.value(name, std::uint64_t{0}) + buffer.bytes;
            total += buffer.bytes;
        }
        const Stats stats = body.simulation.stats();
        for (const PassTime& pass : stats.passes) {
            const std::string name(name_of(pass.pass));
            passes[name] = passes.value(name, 0.0) + pass.seconds;
        }
        seconds += stats.step_seconds;
        health.strands_reset += stats.health.strands_reset;
        health.strands_teleported += stats.health.strands_teleported;
        health.strands_asleep += stats.health.strands_asleep;
        health.roots_refused += stats.health.roots_refused;
        health.small_steps += stats.health.small_steps;
    }
    bytes["total"] = total;
    out["bytes"] = bytes;
    out["seconds"]["total"] = seconds;
    for (const auto& [name, value] : passes.items()) out["seconds"][name] = value;
    out["small_steps"] = health.small_steps;
    out["health"] = {{"strands_reset", health.strands_reset},
                     {"strands_asleep", health.strands_asleep},
                     {"strands_teleported", health.strands_teleported},
                     {"roots_refused", health.roots_refused}};
}

}  // namespace

Result<std::unique_ptr<SolverRun>> make_strand_run(const Scene& scene, const RunOptions& options) {
    if (!scene.strands.empty())
        return Error{ErrorCode::unsupported, scene.file + ": strands",
                     "the strand solver runs baked assets, not explicit strands; write \"solver\": "
                     "\"rod\" or bake the strands"};
    if (options.convergence)
        return Error{ErrorCode::unsupported, "--convergence",
                     "the strand solver does a fixed number of iterations; it belongs to the rod "
                     "solver"};
    auto run = std::make_unique<StrandRun>();
    run->scene_ = scene;
    run->bodies_.reserve(scene.assets.size());
    if (auto ok = run->set_up(options); !ok) return ok.error();
    return std::unique_ptr<SolverRun>(std::move(run));
}

}  // namespace keratin
