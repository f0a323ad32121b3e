// The `rod` solver over a scene: the guides of its assets, in their order, then its explicit
// strands.
#include "runtime/run/asset_body.h"
#include "runtime/run/mesh_frames.h"
#include "runtime/run/motion.h"
#include "runtime/run/rod_scene.h"
#include "runtime/run/solver_run.h"
#include "schema/file_hash.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numbers>

namespace keratin {

namespace {

using measure::Point;
using Json = nlohmann::ordered_json;

std::array<float, 3> to_float(Point p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

// Numbers that nothing prescribes: three a vertex and one an edge, less those of held ends.
std::uint64_t free_numbers(std::uint64_t vertices, EndKind root, EndKind tip) {
    const auto held = [](EndKind kind) -> std::uint64_t {
        return kind == EndKind::free ? 0 : kind == EndKind::clamped_two_points ? 7 : 3;
    };
    return 4 * vertices - 1 - std::min(4 * vertices - 1, held(root) + held(tip));
}

// An asset whose guides are rods.
struct RodBody : AssetBody {
    std::size_t first_rod = 0;
    std::vector<RigidTransform> root;  // [guides] at root_time
    double root_time = 0;
    // Carries the render strands along with the guides; none: they are left out.
    std::unique_ptr<Simulation> follower;
    std::string no_follower;  // why
};

// The simulation that carries the render strands: nothing but roots and interpolation.
Result<Simulation> make_follower(const AssetBody& body, const RunOptions& options) {
    Settings settings;
    settings.threads = options.threads;
    settings.lod = static_cast<float>(body.scene->lod);
    settings.asset_colliders = false;
    PassSwitches& passes = settings.passes;
    passes.grid_friction = passes.grid_volume = passes.stretch = passes.local_shape =
        passes.global_length = passes.collision = false;
    return Simulation::create(body.asset, settings);
}

class RodRun final : public SolverRun {
  public:
    explicit RodRun(const Scene& scene) : scene_(scene) {}

    Result<void> set_up(const RunOptions& options);

    const RunLayout& layout() const override { return layout_; }
    std::string explain() const override;
    void plan(Json& out) const override;
    Result<void> step(double t0, double t1) override;
    void look(RunState& out) const override;
    void statistics(Json& out) const override;
    std::string hash() const override;
    Result<std::vector<std::byte>> save() const override;
    Result<void> load(std::span<const std::byte> state, double time) override;

  private:
    Result<void> add_body(const SceneAsset& asset, const RunOptions& options,
                          std::vector<RodStrand>& strands);
    void add_to_layout(const SceneStrand& strand, std::size_t index);
    std::vector<std::pair<std::string, std::string>> left_out() const;
    std::string place(const std::string& where) const;
    Result<void> move_guides(double t0, double t1);
    Result<void> move_ends(double t0, double t1);
    void look_at(const RodBody& body, RunState& out, double& elastic) const;
    bool has_colliders() const;
    std::uint64_t follower_bytes() const;

    Scene scene_;
    RunLayout layout_;
    std::vector<RodBody> bodies_;
    std::size_t first_explicit_ = 0;  // rod of the scene's first explicit strand
    std::vector<std::unique_ptr<TriangleTree>> meshes_;
    std::unique_ptr<RodSimulation> rods_;
    std::unique_ptr<StrandContact> contact_;
    bool keep_convergence_ = false;
    double time_ = 0, seconds_ = 0, max_stretch_ = 0, last_step_ = 0;
    std::uint64_t steps_ = 0, contact_iterations_ = 0, lost_ = 0, indefinite_ = 0;
};

Result<void> RodRun::set_up(const RunOptions& options) {
    if (scene_.wind.gust > 0 || scene_.wind.turbulence > 0)
        return Error{ErrorCode::unsupported, scene_.file + ": wind",
                     "the rod solver knows steady wind only; leave out gust and turbulence"};
    keep_convergence_ = options.convergence;
    layout_ = empty_layout(scene_, options, "rod");
    std::vector<RodStrand> strands;
    bodies_.reserve(scene_.assets.size());  // colliders point to them
    for (const SceneAsset& asset : scene_.assets)
        if (auto ok = add_body(asset, options, strands); !ok) return ok;
    first_explicit_ = strands.size();
    for (const SceneStrand& strand : scene_.strands) strands.push_back(to_rod(strand));
    auto rods = RodSimulation::create(strands, to_settings(scene_, options));
    if (!rods) return Error{rods.error().code, place(rods.error().where), rods.error().message};
    rods_ = std::make_unique<RodSimulation>(std::move(*rods));
    if (scene_.settings.contact != "none") {
        std::vector<ContactCollider> colliders;
        if (auto ok = add_colliders(scene_, meshes_, colliders); !ok) return ok;
        for (const RodBody& body : bodies_)
            if (auto ok = add_asset_colliders(body, colliders); !ok) return ok;
        contact_ =
            std::make_unique<StrandContact>(to_contact(scene_, options), std::move(colliders));
        rods_->attach_contact(contact_.get());
    }
    for (std::size_t s = 0; s < scene_.strands.size(); ++s) add_to_layout(scene_.strands[s], s);
    // The rest shape of a rod is its own; the scene's strands have no texture coordinates.
    layout_.unloaded.clear();
    if (layout_.uv.size() != 2 * layout_.id.size()) layout_.uv.clear();
    return {};
}

// "strands[3].points[1]" of the rods as the user knows it: the guide of an asset or the scene's
// strand.
std::string RodRun::place(const std::string& where) const {
    const std::string_view list = "strands[";
    if (where.compare(0, list.size(), list) != 0) return scene_.file + ": " + where;
    const std::size_t rod = std::strtoull(where.c_str() + list.size(), nullptr, 10);
    const std::string rest = where.substr(where.find(']') + 1);
    for (const RodBody& body : bodies_)
        if (rod >= body.first_rod && rod < body.first_rod + body.lanes.size())
            return body.scene->file + ": guide " +
                   std::to_string(body.lanes[rod - body.first_rod]) + rest;
    return scene_.file + ": strands[" + std::to_string(rod - first_explicit_) + "]" + rest;
}

Result<void> RodRun::add_body(const SceneAsset& scene, const RunOptions& options,
                              std::vector<RodStrand>& strands) {
    auto opened = open_body(scene);
    if (!opened) return opened.error();
    bodies_.push_back(RodBody{std::move(*opened), strands.size(), {}, 0, nullptr, {}});
    RodBody& body = bodies_.back();
    if (body.asset.info().attach == Attach::all)
        return Error{
            ErrorCode::unsupported, scene.file,
            "every point follows its root (\"attach\": \"all\" in the recipe), which leaves "
            "the rod solver nothing to simulate; bake it with \"attach\": \"bone\" or "
            "\"triangle\", or run the strand solver"};
    const std::uint64_t numbers = layout_.degrees_of_freedom;
    add_guides(body, 1, layout_);
    layout_.degrees_of_freedom = numbers;
    guide_roots(body, 0, body.root);
    for (std::size_t g = 0; g < body.lanes.size(); ++g) {
        strands.push_back(to_rod(body, body.lanes[g], body.root[g]));
        const auto& radii = strands.back().material.radii;
        layout_.thickness.push_back(std::max(radii[0], radii[1]));
        layout_.degrees_of_freedom +=
            free_numbers(body.guide_points(g), EndKind::clamped, EndKind::free);
    }
    if (scene_.settings.interpolation.value_or(true)) {
        auto follower = make_follower(body, options);
        if (follower)
            body.follower = std::make_unique<Simulation>(std::move(*follower));
        else if (follower.error().code == ErrorCode::unsupported)
            body.no_follower = to_string(follower.error());
        else
            return Error{follower.error().code, scene.file, to_string(follower.error())};
    } else {
        body.no_follower = "switched off in the settings";
    }
    add_render_strands(body, body.follower ? body.follower->strands().strand_count : 0, layout_);
    return {};
}

void RodRun::add_to_layout(const SceneStrand& strand, std::size_t s) {
    const auto& rest = strand.rest_points.empty() ? strand.points : strand.rest_points;
    CacheHead& head = layout_.head;
    for (const Double3& p : rest) layout_.rest.push_back(to_point(p));
    head.guide_first_point.push_back(static_cast<std::uint32_t>(layout_.rest.size()));
    head.guide_lane.push_back(kNoStrand);
    head.strand_first_point.push_back(head.strand_first_point.back() +
                                      static_cast<std::uint32_t>(rest.size()));
    head.strand_radius.push_back(static_cast<float>(std::max(strand.radii[0], strand.radii[1])));
    layout_.thickness.push_back(std::max(strand.radii[0], strand.radii[1]));
    layout_.id.push_back(static_cast<std::uint32_t>(s));
    for (std::size_t v = 0; v < rods_->vertex_count(first_explicit_ + s); ++v)
        layout_.mass.push_back(rods_->vertex_mass(first_explicit_ + s, v));
    const double area = std::numbers::pi * strand.radii[0] * strand.radii[1];
    layout_.stretch_stiffness.push_back(strand.youngs_modulus * area);
    layout_.bend_stiffness.push_back(
        strand.youngs_modulus * area *
        (strand.radii[0] * strand.radii[0] + strand.radii[1] * strand.radii[1]) / 8);
    layout_.held_points.push_back(strand.root == EndKind::free                 ? 0
                                  : strand.root == EndKind::clamped_two_points ? 2
                                                                               : 1);
    layout_.degrees_of_freedom += free_numbers(strand.points.size(), strand.root, strand.tip);
}

bool RodRun::has_colliders() const {
    return !scene_.colliders.empty() ||
           std::any_of(bodies_.begin(), bodies_.end(),
                       [](const RodBody& body) { return !body.asset.info().colliders.empty(); });
}

std::vector<std::pair<std::string, std::string>> RodRun::left_out() const {
    std::vector<std::pair<std::string, std::string>> out;
    if (!contact_)
        for (const char* part : {"collision_detection", "contact_bookkeeping", "impulse_solve"})
            out.emplace_back(part, "settings.contact is none");
    else if (!has_colliders())
        out.emplace_back("contact with colliders", "there are no colliders");
    for (const RodBody& body : bodies_)
        if (!body.follower)
            out.emplace_back("interpolate", body.scene->file + ": " + body.no_follower);
    if (!bodies_.empty()) {
        out.emplace_back("damping, friction, volume, iterations, length of a recipe's \"strand\"",
                         "they are the strand solver's; rods have the recipe's material");
        const Double3& wind = scene_.wind.velocity;
        if (wind[0] != 0 || wind[1] != 0 || wind[2] != 0)
            out.emplace_back("wind on the guides of assets", "an asset knows no air_drag");
    }
    const SceneSettings& in = scene_.settings;
    if (in.stretch_scale.value_or(1) != 1 || in.bend_scale.value_or(1) != 1 ||
        in.twist_scale.value_or(1) != 1)
        for (const RodBody& body : bodies_)
            if (!body.asset.fields().guide_rod_strain.empty())
                out.emplace_back("rest in the groomed shape",
                                 body.scene->file +
                                     ": it is sag-free for stretch_scale, bend_scale and "
                                     "twist_scale 1; the scene writes others");
    return out;
}

std::string RodRun::explain() const {
    Json all;
    plan(all);
    std::string out = "parts of a step, in order:\n";
    for (const Json& pass : all[0]["passes"]) out += "  " + pass["name"].get<std::string>() + "\n";
    out += "buffers:\n";
    for (const Json& buffer : all[0]["buffers"])
        out += "  " + buffer["name"].get<std::string>() + " " +
               std::to_string(buffer["bytes"].get<std::uint64_t>()) + " bytes\n";
    out += "left out:\n";
    for (const Json& left : all[0]["left_out"])
        out += "  " + left["name"].get<std::string>() + ": " + left["reason"].get<std::string>() +
               "\n";
    return out;
}

void RodRun::plan(Json& out) const {
    Json passes = Json::array(), left = Json::array();
    passes.push_back({{"name", "prepare"}});
    passes.push_back({{"name", "dynamics"}});
    if (contact_)
        for (const char* part : {"collision_detection", "contact_bookkeeping", "impulse_solve"})
            passes.push_back({{"name", part}});
    Json buffers = Json::array({{{"name", "strands"}, {"bytes", rods_->stats().bytes}}});
    if (const std::uint64_t bytes = follower_bytes(); bytes > 0) {
        passes.push_back({{"name", "interpolate"}});
        buffers.push_back({{"name", "render_strands"}, {"bytes", bytes}});
    }
    for (const auto& [name, reason] : left_out())
        left.push_back({{"name", name}, {"reason", reason}});
    out = Json::array();
    out.push_back({{"passes", passes}, {"buffers", buffers}, {"left_out", left}});
}

std::uint64_t RodRun::follower_bytes() const {
    std::uint64_t bytes = 0;
    for (const RodBody& body : bodies_)
        if (body.follower) bytes += body.follower->plan().total_bytes();
    return bytes;
}

// The roots of guides, from where they were at t0 to where they shall be at t1.
Result<void> RodRun::move_guides(double t0, double t1) {
    std::vector<RigidTransform> next;
    for (RodBody& body : bodies_) {
        if (body.root_time != t0) guide_roots(body, t0, body.root);
        guide_roots(body, t1, next);
        for (std::size_t g = 0; g < next.size(); ++g) {
            const Point root = layout_.rest[layout_.head.guide_first_point[body.first_guide + g]];
            const RodEndTarget target{to_double3(apply(to_rigid(next[g]), root)),
                                      turn_between(body.root[g].rotation, next[g].rotation)};
            if (auto ok = rods_->move_root(body.first_rod + g, target); !ok)
                return Error{ok.error().code, place(ok.error().where), ok.error().message};
        }
        body.root.swap(next);
        body.root_time = t1;
    }
    return {};
}

// The held ends of explicit strands.
Result<void> RodRun::move_ends(double t0, double t1) {
    for (std::size_t s = 0; s < scene_.strands.size(); ++s) {
        const SceneStrand& strand = scene_.strands[s];
        const auto target = [&](const Motion& motion, const Double3& point) {
            const RigidTransform from = pose_at(motion, t0), to = pose_at(motion, t1);
            return RodEndTarget{to_double3(apply(to_rigid(to), to_point(point))),
                                turn_between(from.rotation, to.rotation)};
        };
        Result<void> ok;
        if (!strand.motion.empty())
            ok =
                rods_->move_root(first_explicit_ + s, target(strand.motion, strand.points.front()));
        if (ok && !strand.tip_motion.empty())
            ok = rods_->move_tip(first_explicit_ + s,
                                 target(strand.tip_motion, strand.points.back()));
        if (!ok)
            return Error{ok.error().code, scene_.file + ": strands[" + std::to_string(s) + "]",
                         ok.error().message};
    }
    return {};
}

Result<void> RodRun::step(double t0, double t1) {
    if (auto ok = move_guides(t0, t1); !ok) return ok;
    if (auto ok = move_ends(t0, t1); !ok) return ok;
    const auto begin = std::chrono::steady_clock::now();
    auto report = rods_->step(t1 - t0);
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (!report) return Error{report.error().code, scene_.file, report.error().message};
    ++steps_;
    contact_iterations_ += report->contact_iterations;
    lost_ += report->lost;
    indefinite_ += report->indefinite;
    max_stretch_ = std::max(max_stretch_, rods_->max_stretch());
    time_ = t1;
    last_step_ = t1 - t0;
    return {};
}

void RodRun::look_at(const RodBody& body, RunState& out, double& elastic) const {
    const AssetFields& fields = body.asset.fields();
    // as Simulation::show takes them
    std::vector<float> rows(body.follower ? fields.guide_position.size() : 0);
    for (std::size_t g = 0; g < body.lanes.size(); ++g) {
        const std::uint32_t lane = body.lanes[g];
        const std::size_t first = fields.tile_first_row[lane / kTileLanes],
                          rod = body.first_rod + g;
        const measure::Rigid root = to_rigid(body.root[g]);
        out.root.push_back(root);
        for (std::size_t p = 0; p < rods_->vertex_count(rod); ++p) {
            const Double3 x = rods_->position(rod, p);
            out.position.push_back(to_point(x));
            out.velocity.push_back(to_point(rods_->velocity(rod, p)));
            out.rigid.push_back(apply(root, layout_.rest[out.position.size() - 1]));
            if (!body.follower) continue;
            for (std::size_t c = 0; c < 3; ++c)
                rows[vector_index(first + p, 3, c, lane % kTileLanes)] = static_cast<float>(x[c]);
        }
        elastic += rods_->energy(rod).elastic();
    }
    out.bodies.push_back(cache_body(body, time_));
    if (!body.follower) return;
    // Motions were finite and the sizes fit when the run was set up.
    [[maybe_unused]] Result<void> ok = set_body_inputs(body, time_, *body.follower);
    if (ok) ok = body.follower->show(rows);
    assert(ok);
    const StrandView strands = body.follower->strands();
    const std::size_t points = fields.strand_first_point[body.strand_count];
    out.strand_position.insert(out.strand_position.end(), strands.position.begin(),
                               strands.position.begin() + static_cast<std::ptrdiff_t>(3 * points));
}

void RodRun::look(RunState& out) const {
    out = {};
    double elastic = 0;
    for (const RodBody& body : bodies_) look_at(body, out, elastic);
    for (std::size_t s = 0; s < scene_.strands.size(); ++s) {
        const SceneStrand& strand = scene_.strands[s];
        const std::size_t rod = first_explicit_ + s;
        const measure::Rigid pose = to_rigid(pose_at(strand.motion, time_));
        out.root.push_back(pose);
        for (const Double3& x : rods_->points(rod)) {
            out.position.push_back(to_point(x));
            for (const double c : x) out.strand_position.push_back(static_cast<float>(c));
        }
        for (const Double3& v : rods_->velocities(rod)) out.velocity.push_back(to_point(v));
        for (const Double3& x : strand.points) out.rigid.push_back(apply(pose, to_point(x)));
        elastic += rods_->energy(rod).elastic();
    }
    out.elastic = elastic;
    for (const SceneCollider& in : scene_.colliders) {
        const RigidTransform motion = pose_at(in.motion, time_);
        const measure::Rigid m = to_rigid(motion);
        const auto at = [&](const Double3& p) { return to_float(apply(m, to_point(p))); };
        const auto& q = motion.rotation;
        const std::array<float, 4> rotation{static_cast<float>(q[0]), static_cast<float>(q[1]),
                                            static_cast<float>(q[2]), static_cast<float>(q[3])};
        if (const auto* plane = std::get_if<PlaneShape>(&in.shape))
            out.colliders.push_back({CacheShape::plane,
                                     at(plane->point),
                                     to_float(turn(m, to_point(plane->normal))),
                                     0,
                                     {0, 0, 0, 1}});
        else if (const auto* sphere = std::get_if<SphereShape>(&in.shape))
            out.colliders.push_back({CacheShape::sphere,
                                     at(sphere->center),
                                     at(sphere->center),
                                     static_cast<float>(sphere->radius),
                                     {0, 0, 0, 1}});
        else if (const auto* capsule = std::get_if<CapsuleShape>(&in.shape))
            out.colliders.push_back({CacheShape::capsule,
                                     at(capsule->a),
                                     at(capsule->b),
                                     static_cast<float>(capsule->radius),
                                     {0, 0, 0, 1}});
        else if (const auto* box = std::get_if<BoxShape>(&in.shape))
            out.colliders.push_back({CacheShape::box, at(box->center),
                                     to_float(to_point(box->half_size)), 0, rotation});
    }
    out.scene_colliders = out.colliders.size();
    if (!contact_) return;
    for (const RodBody& body : bodies_)
        for (const CacheCollider& collider : cache_asset_colliders(body, time_))
            out.colliders.push_back(collider);
}

void RodRun::statistics(Json& out) const {
    const RodStats& stats = rods_->stats();
    const auto each_step = [&](double sum) {
        return steps_ ? sum / static_cast<double>(steps_) : 0;
    };
    const std::uint64_t followers = follower_bytes();
    out["bytes"] = {{"strands", stats.bytes}};
    if (followers > 0) out["bytes"]["render_strands"] = followers;
    out["bytes"]["total"] = stats.bytes + followers;
    out["seconds"] = {{"total", seconds_},
                      {"prepare", stats.prepare},
                      {"dynamics", stats.dynamics},
                      {"collision_detection", stats.collision_detection},
                      {"contact_bookkeeping", stats.contact_bookkeeping},
                      {"impulse_solve", stats.impulse_solve}};
    out["max_stretch"] = std::max(out["max_stretch"].get<double>(), max_stretch_);
    out["steps_at_cap"] = stats.steps_at_cap;
    out["steps_halved"] = stats.steps_halved;
    out["iterations_mean"] =
        contact_ ? each_step(static_cast<double>(contact_iterations_))
                 : each_step(static_cast<double>(stats.strand_iterations) /
                             static_cast<double>(std::max<std::size_t>(1, rods_->strand_count())));
    out["health"] = {{"strands_lost", lost_}, {"hessians_indefinite", indefinite_}};
    if (contact_) {
        const ContactTotals& totals = contact_->totals();
        const double all = std::max(1.0, static_cast<double>(totals.steps));
        out["contacts_mean"] = static_cast<double>(totals.contacts) / all;
        out["contacts_max"] = totals.most_contacts;
        // The scales of METHODS 2.10: h |g|, or 1e-2 m/s without gravity, and that times the mean
        // mass of the vertices.
        const double g = measure::length(to_point(scene_.gravity));
        const double velocity = g > 0 ? last_step_ * g : 1e-2;
        double mass = 0;
        for (const double m : layout_.mass) mass += m;
        mass /= static_cast<double>(std::max<std::size_t>(1, layout_.mass.size()));
        out["coulomb_residual"] = {{"mean", totals.residual_sum / all},
                                   {"velocity_scale", velocity},
                                   {"impulse_scale", velocity * mass}};
    }
    if (keep_convergence_) {
        out["convergence"] = Json::array();
        const std::span<const double> residuals =
            contact_ ? contact_->residuals() : std::span<const double>();
        std::size_t pass = 0;
        for (const RodConvergence& c : rods_->convergence()) {
            const Json f_fb = pass < residuals.size() ? Json(residuals[pass++]) : Json();
            out["convergence"].push_back({{"dv", c.dv}, {"dr", c.dr}, {"f_fb", f_fb}});
        }
    }
}

std::string RodRun::hash() const {
    std::vector<Double3> all;
    for (std::size_t s = 0; s < rods_->strand_count(); ++s)
        for (const Double3& x : rods_->points(s)) all.push_back(x);
    return to_string(hash_bytes(std::as_bytes(std::span(all)))).substr(0, 16);
}

// What a saved state begins with.
struct StateHead {
    std::uint64_t rod_bytes = 0, contact_bytes = 0;
};

Result<std::vector<std::byte>> RodRun::save() const {
    const std::vector<std::byte> rods = rods_->save(),
                                 contacts = contact_ ? contact_->save() : std::vector<std::byte>();
    std::vector<std::byte> out;
    const auto put = [&](std::span<const std::byte> bytes) {
        out.insert(out.end(), bytes.begin(), bytes.end());
    };
    const StateHead head{rods.size(), contacts.size()};
    put(std::as_bytes(std::span(&head, 1)));
    put(rods);
    put(contacts);
    return out;
}

Result<void> RodRun::load(std::span<const std::byte> state, double time) {
    const Error other{ErrorCode::input, "", "the state is of another scene"};
    StateHead head;
    if (state.size() < sizeof head) return other;
    std::memcpy(&head, state.data(), sizeof head);
    state = state.subspan(sizeof head);
    if (head.rod_bytes > state.size() || state.size() - head.rod_bytes != head.contact_bytes ||
        (head.contact_bytes > 0) != !!contact_)
        return other;
    if (auto ok = rods_->restore(state.first(head.rod_bytes)); !ok) return ok;
    if (contact_)
        if (auto ok = contact_->restore(state.subspan(head.rod_bytes)); !ok) return ok;
    time_ = time;
    for (RodBody& body : bodies_) {
        guide_roots(body, time, body.root);
        body.root_time = time;
    }
    return {};
}

}  // namespace

Result<std::unique_ptr<SolverRun>> make_rod_run(const Scene& scene, const RunOptions& options) {
    auto run = std::make_unique<RodRun>(scene);
    if (auto ok = run->set_up(options); !ok) return ok.error();
    return std::unique_ptr<SolverRun>(std::move(run));
}

}  // namespace keratin
