#include "runtime/simulation.h"

#include "runtime/state.h"
#include "schema/formula/frame.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace keratin {

namespace {

bool finite(const RigidTransform& t) {
    return std::ranges::all_of(t.translation, [](double v) { return std::isfinite(v); }) &&
           std::ranges::all_of(t.rotation, [](double v) { return std::isfinite(v); });
}

Result<RigidTransform> checked(const RigidTransform& t, const char* what) {
    if (!finite(t)) return Error{ErrorCode::input, what, "must be finite"};
    const Vec4d q = rotation_of(t);
    const double norm = std::sqrt(dot(q, q));
    if (!(norm > 1e-6)) return Error{ErrorCode::input, what, "has a rotation of length zero"};
    const Vec4d unit = q * (1 / norm);
    return transform_of(unit, translation_of(t));
}

Result<void> check_triangles(const AssetInfo& info, const AssetFields& fields,
                             std::span<const std::uint32_t> used) {
    for (std::uint32_t source : used) {
        const std::uint32_t slot = stored_triangle(fields, source);
        if (slot >= info.triangle_count ||
            (!fields.mesh_triangle_source.empty() && fields.mesh_triangle_source[slot] != source))
            return Error{ErrorCode::input, "triangle " + std::to_string(source),
                         "carries a root but is not stored in the asset"};
    }
    return {};
}

void allocate(Simulation::State& s) {
    const Host& host = s.settings.host;
    const RunShape& shape = s.shape;
    const std::size_t point_lanes = std::size_t{shape.rows} * kTileLanes;
    const auto planned = [&](BufferId id) { return s.plan.has(id); };
    if (planned(BufferId::position)) s.position.allocate(point_lanes * 3, host);
    if (planned(BufferId::previous)) s.previous.allocate(point_lanes * 3, host);
    if (planned(BufferId::rest_edge)) s.rest_edge.allocate(point_lanes * 3, host);
    if (planned(BufferId::filling_rest))
        s.filling_rest.allocate(point_lanes * kFillingRestFloats, host);
    if (planned(BufferId::root)) {
        const std::size_t floats = (shape.one_motion ? 1 : shape.tiles) * kRootFloats * kTileLanes;
        s.root_begin.allocate(floats, host);
        s.root_end.allocate(floats, host);
    }
    if (planned(BufferId::strand_root))
        s.strand_root.allocate((shape.one_motion ? 1 : std::size_t{shape.strands}) * kRootFloats,
                               host);
    if (planned(BufferId::guide_line)) s.line.allocate(point_lanes * 3 + kLineBehind, host);
    if (planned(BufferId::strand_position)) {
        if (shape.half)
            s.strand_half.allocate(std::size_t{shape.points} * 3, host);
        else
            s.strand_position.allocate(std::size_t{shape.points} * 3, host);
    }
    if (planned(BufferId::strand_tangent))
        s.strand_tangent.allocate(std::size_t{shape.points} * 3, host);
    if (planned(BufferId::strand_previous)) {
        if (shape.half)
            s.strand_half_previous.allocate(std::size_t{shape.points} * 3, host);
        else
            s.strand_previous.allocate(std::size_t{shape.points} * 3, host);
    }
    if (planned(BufferId::mesh_position))
        s.mesh_next.allocate(std::size_t{shape.vertices} * 3, host);
    if (planned(BufferId::triangle_slot)) {
        if (shape.simulated)
            s.guide_triangle_slot.allocate(std::size_t{shape.tiles} * kTileLanes, host);
        s.strand_triangle_slot.allocate(shape.strands, host);
    }
    if (planned(BufferId::grid_sum)) {
        const std::size_t bricks = std::size_t{shape.grid_bricks_along} * shape.grid_bricks_along *
                                   shape.grid_bricks_along;
        const std::size_t voxels = bricks * kBrickVoxels;
        if (shape.friction) s.grid_momentum.allocate(voxels * 4 * shape.threads, host);
        if (shape.volume) s.grid_filling.allocate(voxels * shape.threads, host);
        s.grid_field.allocate(voxels * grid_field_floats(shape.friction), host);
        s.grid_touched.allocate(bricks * shape.threads, host);
        s.grid_live.allocate(bricks, host);
        for (std::size_t t = 0; t < shape.threads; ++t) {
            GridSums sums;
            sums.momentum = shape.friction ? s.grid_momentum.data() + t * voxels * 4 : nullptr;
            sums.filling = shape.volume ? s.grid_filling.data() + t * voxels : nullptr;
            sums.touched = s.grid_touched.data() + t * bricks;
            s.grid_sums.push_back(sums);
        }
    }
    if (planned(BufferId::collider)) {
        s.solids.allocate(shape.colliders, host);
        s.poses.allocate(std::size_t{shape.colliders} * kStepsAtOnce, host);
    }
    if (planned(BufferId::quad_state)) {
        s.quads.allocate(shape.quads, host);
        s.classes.allocate(s.class_keys.size(), host);
    }
    if (planned(BufferId::scratch)) {
        s.scratch_stride = kScratchRow * shape.longest + root_slot_count * kBlockLanes;
        s.scratch.allocate(s.scratch_stride * shape.threads, host);
        s.near.allocate(near_stride(shape.colliders) * shape.threads, host);
    }
}

// Groups of quads that share parameters; the asset keeps one group a quad.
void sort_classes(Simulation::State& s, std::vector<std::uint32_t>& class_of) {
    for (std::uint32_t q = 0; q < s.shape.quads; ++q) {
        const Simulation::State::ClassKey key{s.fields.guide_group[q * kQuadLanes], s.quad_rows(q)};
        const auto same = [&](const auto& k) { return k.group == key.group && k.rows == key.rows; };
        auto at = std::ranges::find_if(s.class_keys, same);
        if (at == s.class_keys.end()) {
            s.class_keys.push_back(key);
            at = s.class_keys.end() - 1;
        }
        class_of.push_back(std::uint32_t(at - s.class_keys.begin()));
    }
}

// The unloaded shape in the root's frame, out of the edges that the asset gives in their parents'
// frames: frames carried along the strand by minimal rotations, METHODS 1.4.
void unload(Simulation::State& s) {
    for (std::size_t tile = 0; tile < s.shape.tiles; ++tile)
        for (std::size_t l = 0; l < kTileLanes; ++l) {
            Vec3f t(1, 0, 0), u(0, 1, 0);
            const std::size_t rows = s.quad_rows(tile / kQuadTiles);
            for (std::size_t p = 1; p < rows; ++p) {
                const std::size_t at = vector_index(s.tile_row(tile) + p, 3, 0, l);
                const float* c = s.fields.guide_shape.data() + at;
                const Vec3f e = from_frame(t, u, Vec3f(c[0], c[16], c[32]));
                float* out = s.rest_edge.data() + at;
                out[0] = e.x, out[16] = e.y, out[32] = e.z;
                const Vec3f next = normalize_or(e, t);
                u = orthonormal_director(next, transport_director(t, next, u));
                t = next;
            }
        }
}

void mean_values(Simulation::State& s) {
    double length = 0, points = 0;
    for (std::size_t tile = 0; tile < s.shape.tiles; ++tile)
        for (std::size_t l = 0; l < kTileLanes; ++l) {
            const std::uint32_t n = s.fields.guide_point_count[tile * kTileLanes + l];
            for (std::uint32_t p = 1; p < n; ++p)
                length += s.fields.guide_length[(s.tile_row(tile) + p) * kTileLanes + l];
            points += n > 0 ? n - 1 : 0;
        }
    s.inverse_mean_length = length > 0 ? float(points / length) : 1.0f;
    // Without stored densities: the hair's mass spread over the box of the groom.
    const Material& m = s.info.groups[0].material;
    double box = 1;
    for (int c = 0; c < 3; ++c)
        box *= std::max(1e-3, double(s.info.bounds_max[c]) - s.info.bounds_min[c]);
    const double per_guide =
        s.info.guide_count > 0
            ? double(std::max(s.info.strand_count, s.info.guide_count)) / s.info.guide_count
            : 1;
    s.mean_density = float(length * per_guide * double(m.density) * 3.14159265358979 * m.radius *
                           m.radius2 / box);
}

// Render strands have not moved: the step before is as this one, from strand `first` on.
void stand_still(Simulation::State& s, std::uint32_t first = 0) {
    const std::size_t from = first > 0 ? std::size_t{s.fields.strand_first_point[first]} * 3 : 0;
    if (s.strand_previous.size() > 0)
        std::copy(s.strand_position.span().begin() + from, s.strand_position.span().end(),
                  s.strand_previous.data() + from);
    if (s.strand_half_previous.size() > 0)
        std::copy(s.strand_half.span().begin() + from, s.strand_half.span().end(),
                  s.strand_half_previous.data() + from);
    s.half_center_previous = s.half_center;
    s.written_count = s.strand_count;
}

// Before a step writes them anew, what was written becomes the step before.
void keep_strands(Simulation::State& s) {
    if (s.strand_previous.size() > 0) std::swap(s.strand_position, s.strand_previous);
    if (s.strand_half_previous.size() > 0) {
        std::swap(s.strand_half, s.strand_half_previous);
        s.half_center_previous = s.half_center;
    }
}

// The render strands follow their guides, and what was to be reached is where things are now.
void arrive(Simulation::State& s) {
    if (s.strand_root.size() > 0) skin_strands(s);
    write_strands(s);
    s.motion_now = s.motion_next;
    s.bones_now = s.bones_next;
    s.collider_now = s.collider_next;
}

void rest_everything(Simulation::State& s) {
    pose_bones(s);
    if (s.simulated()) {
        skin_guides(s);
        std::copy(s.root_end.span().begin(), s.root_end.span().end(), s.root_begin.data());
        for (std::size_t tile = 0; tile < s.shape.tiles; ++tile)
            for (std::size_t lane = 0; lane < kTileLanes; ++lane) put_to_rest(s, tile, lane);
        measure_quads(s);
    }
    arrive(s);
    s.first_step = true;
    s.previous_step = 0;
    stand_still(s);
}

void log(const Simulation::State& s, LogLevel level, const char* format, auto... values) {
    const Host& host = s.settings.host;
    if (!host.log) return;
    char line[160];
    std::snprintf(line, sizeof line, format, values...);
    host.log(host.user, level, line);
}

}  // namespace

Simulation::Simulation(std::unique_ptr<State> state) : state_(std::move(state)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

Result<Simulation> Simulation::create(const AssetInfo& info, const AssetFields& fields,
                                      const Settings& settings) {
    auto plan = make_plan(info, fields, settings);
    if (!plan) return plan.error();
    if (info.attach == Attach::triangle) {
        if (auto r = check_triangles(info, fields, fields.guide_triangle); !r) return r.error();
        if (auto r = check_triangles(info, fields, fields.strand_triangle); !r) return r.error();
    }

    auto state = std::make_unique<State>();
    State& s = *state;
    s.info = info;
    s.fields = fields;
    s.settings = settings;
    s.plan = std::move(*plan);
    s.shape = run_shape(info, fields, settings);
    s.threads = int(s.shape.threads);
    s.kernels = &kernels_of(usable_instruction_set(settings.instruction_set));
    s.times.resize(s.shape.threads);
    s.strand_count = s.shape.strands;
    s.bones_now.resize(info.bones.size());
    s.bones_next.resize(info.bones.size());
    s.bone_world.resize(std::max<std::size_t>(1, info.bones.size()));

    std::vector<std::uint32_t> class_of;
    if (s.simulated()) sort_classes(s, class_of);
    try {
        allocate(s);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::io, "memory",
                     "there are no " + std::to_string(s.plan.total_bytes()) + " bytes"};
    }
    for (std::uint32_t q = 0; q < s.quads.size(); ++q) {
        s.quads[q].group_class = class_of[q];
        for (std::size_t l = 0; l < kQuadLanes; ++l)
            s.quads[q].guides += fields.guide_point_count[q * kQuadLanes + l] > 0;
    }
    for (std::size_t i = 0; i < s.guide_triangle_slot.size(); ++i)
        s.guide_triangle_slot[i] = stored_triangle(fields, fields.guide_triangle[i]);
    for (std::size_t i = 0; i < s.strand_triangle_slot.size(); ++i)
        s.strand_triangle_slot[i] = stored_triangle(fields, fields.strand_triangle[i]);
    std::copy(fields.mesh_position.begin(), fields.mesh_position.begin() + s.mesh_next.size(),
              s.mesh_next.data());
    if (s.simulated()) mean_values(s);
    if (s.rest_edge.size() > 0) unload(s);
    make_wind(s);
    if (s.solids.size() > 0) make_solids(s);
    for (const Collider& c : settings.colliders) {
        auto motion = checked(c.motion, "colliders.motion");
        if (!motion) return motion.error();
        s.collider_next.push_back(*motion);
    }
    s.collider_next.resize(std::max(s.collider_next.size(), s.solids.size()));
    rest_everything(s);
    if (s.filling_rest.size() > 0) measure_filling(s);
    log(s, LogLevel::note, "%u guides, %u render strands, %llu bytes", s.info.guide_count,
        s.shape.strands, static_cast<unsigned long long>(s.plan.total_bytes()));
    return Simulation(std::move(state));
}

const SolverPlan& Simulation::plan() const { return state_->plan; }
const Settings& Simulation::settings() const { return state_->settings; }
const AssetInfo& Simulation::info() const { return state_->info; }
const AssetFields& Simulation::fields() const { return state_->fields; }

Result<void> Simulation::set_motion(const RigidTransform& motion) {
    auto t = checked(motion, "motion");
    if (!t) return t.error();
    state_->motion_next = *t;
    return {};
}

Result<void> Simulation::set_bones(std::span<const RigidTransform> bones) {
    if (bones.size() != state_->info.bones.size())
        return Error{ErrorCode::input, "bones",
                     std::to_string(bones.size()) + " poses for " +
                         std::to_string(state_->info.bones.size()) + " bones"};
    for (std::size_t i = 0; i < bones.size(); ++i)
        if (!checked(bones[i], "bones"))
            return Error{ErrorCode::input, "bones[" + std::to_string(i) + "]",
                         "must be finite, with a rotation"};
    for (std::size_t i = 0; i < bones.size(); ++i)
        state_->bones_next[i] = *checked(bones[i], "bones");
    return {};
}

Result<void> Simulation::set_mesh(std::span<const float> positions) {
    State& s = *state_;
    if (positions.size() != std::size_t{s.info.mesh_vertex_count} * 3)
        return Error{ErrorCode::input, "mesh",
                     std::to_string(positions.size() / 3) + " vertices for a mesh of " +
                         std::to_string(s.info.mesh_vertex_count)};
    for (std::size_t v = 0; v < s.mesh_next.size() / 3; ++v) {
        const std::size_t from =
            s.fields.mesh_vertex_source.empty() ? v : s.fields.mesh_vertex_source[v];
        for (std::size_t c = 0; c < 3; ++c) s.mesh_next[v * 3 + c] = positions[from * 3 + c];
    }
    return {};
}

Result<void> Simulation::set_collider(std::size_t index, const RigidTransform& motion) {
    if (index >= state_->settings.colliders.size())
        return Error{ErrorCode::input, "collider " + std::to_string(index), "does not exist"};
    auto t = checked(motion, "collider");
    if (!t) return t.error();
    state_->collider_next[index] = *t;
    return {};
}

Result<void> Simulation::set_gravity(const std::array<float, 3>& gravity) {
    for (float v : gravity)
        if (!std::isfinite(v)) return Error{ErrorCode::input, "gravity", "must be finite"};
    state_->settings.gravity = gravity;
    state_->disturbed = true;
    return {};
}

Result<void> Simulation::set_wind(const Wind& wind) {
    for (float v : wind.velocity)
        if (!std::isfinite(v)) return Error{ErrorCode::input, "wind.velocity", "must be finite"};
    if (!(wind.gust >= 0 && wind.gust <= 1 && wind.turbulence >= 0 && wind.turbulence <= 1))
        return Error{ErrorCode::input, "wind", "gust and turbulence must be between 0 and 1"};
    state_->settings.wind = wind;
    state_->disturbed = true;
    return {};
}

Result<void> Simulation::set_lod(float share) {
    State& s = *state_;
    if (!(share >= 0 && share <= s.settings.lod))
        return Error{ErrorCode::input, "lod",
                     "must be between 0 and the " + std::to_string(s.settings.lod) +
                         " that the simulation was made for"};
    s.strand_count = std::min(
        s.shape.strands, std::uint32_t(std::floor(double(s.info.strand_count) * share + 1e-6)));
    return {};
}

Result<void> Simulation::step(double h) {
    State& s = *state_;
    const HealthCounters before = s.health;
    keep_strands(s);
    if (auto done = advance(s, h); !done) {
        keep_strands(s);
        return done;
    }
    // Strands that a higher level of detail has just brought in have no step before.
    if (s.strand_count > s.written_count) stand_still(s, s.written_count);
    s.written_count = s.strand_count;
    if (const auto reset = s.health.strands_reset - before.strands_reset; reset > 0)
        log(s, LogLevel::warning, "%llu strands were not finite and were put back to rest",
            static_cast<unsigned long long>(reset));
    if (const auto roots = s.health.roots_refused - before.roots_refused; roots > 0)
        log(s, LogLevel::warning, "%llu roots were not finite and stay where they were",
            static_cast<unsigned long long>(roots));
    return {};
}

void Simulation::reset() {
    rest_everything(*state_);
    state_->time = 0;
}

void Simulation::teleport(Velocity velocity) {
    State& s = *state_;
    pose_bones(s);
    if (s.simulated()) {
        skin_guides(s);
        s.health.strands_teleported += carry_jumps(s, true, velocity);
        std::copy(s.root_end.span().begin(), s.root_end.span().end(), s.root_begin.data());
        for (std::size_t i = s.settings.colliders.size(); i < s.solids.size(); ++i) {
            const std::uint32_t bone = asset_collider_bone(s.info, i - s.settings.colliders.size());
            s.collider_next[i] = s.bone_world[bone < s.bone_world.size() ? bone : 0];
        }
        measure_quads(s);
    }
    arrive(s);
    stand_still(s);
}

Result<void> Simulation::show(std::span<const float> position) {
    State& s = *state_;
    if (position.size() != s.position.size())
        return Error{ErrorCode::input, "guides",
                     std::to_string(position.size()) + " coordinates for " +
                         std::to_string(s.position.size())};
    keep_strands(s);
    pose_bones(s);
    if (s.simulated()) {
        skin_guides(s);
        std::copy(s.root_end.span().begin(), s.root_end.span().end(), s.root_begin.data());
        for (std::size_t lane = 0; lane < s.fields.guide_point_count.size(); ++lane) {
            const std::size_t first = s.tile_row(lane / kTileLanes);
            put_to_rest(s, lane / kTileLanes, lane % kTileLanes);
            for (std::uint32_t p = 0; p < s.fields.guide_point_count[lane]; ++p)
                for (std::size_t c = 0; c < 3; ++c) {
                    const std::size_t at = vector_index(first + p, 3, c, lane % kTileLanes);
                    s.position[at] = s.previous[at] = position[at];
                }
        }
        measure_quads(s);
    }
    arrive(s);
    s.written_count = s.strand_count;
    return {};
}

const std::array<double, 3>& Simulation::origin() const { return state_->settings.origin; }

void Simulation::set_origin(const std::array<double, 3>& origin) {
    State& s = *state_;
    float shift[3];
    for (int c = 0; c < 3; ++c) shift[c] = float(s.settings.origin[c] - origin[c]);
    s.settings.origin = origin;
    for (Block64<float>* block : {&s.position, &s.previous})
        for (std::size_t row = 0; row * 16 < block->size(); ++row)
            for (std::size_t l = 0; l < 16; ++l) (*block)[row * 16 + l] += shift[row % 3];
    for (Block64<float>* block : {&s.root_begin, &s.root_end})
        for (std::size_t row = 0; row * 16 < block->size(); ++row)
            if (row % kRootFloats >= 4)
                for (std::size_t l = 0; l < 16; ++l)
                    (*block)[row * 16 + l] += shift[row % kRootFloats - 4];
    for (QuadState& q : s.quads.span())
        for (int c = 0; c < 3; ++c) q.bounds_min[c] += shift[c], q.bounds_max[c] += shift[c];
    if (s.strand_root.size() > 0) skin_strands(s);
    write_strands(s);
    for (std::size_t i = 0; i < s.strand_previous.size(); ++i) s.strand_previous[i] += shift[i % 3];
    for (std::size_t c = 0; c < 3; ++c) s.half_center_previous[c] += shift[c];
}

double Simulation::time() const { return state_->time; }

GuideView Simulation::guides() const {
    const State& s = *state_;
    return {s.position.span(), s.previous.span(), s.previous_step};
}

StrandView Simulation::strands() const {
    const State& s = *state_;
    StrandView v;
    v.first_point = s.fields.strand_first_point.first(s.shape.strands + 1);
    v.position = s.strand_position.span();
    v.position_half = s.strand_half.span();
    v.tangent = s.strand_tangent.span();
    v.previous = s.strand_previous.span();
    v.previous_half = s.strand_half_previous.span();
    v.half_center_previous = s.half_center_previous;
    v.radius = s.fields.strand_radius;
    v.uv = s.fields.strand_uv;
    v.id = s.fields.strand_id;
    v.half_center = s.half_center;
    v.strand_count = s.plan.has(BufferId::strand_position) ? s.strand_count : 0;
    v.width_scale = width_scale(s.info.levels, s.info.strand_count, v.strand_count);
    // Render points are rest points carried by a root plus a mean of guide displacements: inside of
    // the guides' box grown by how far the groom reaches from its guides at rest, which the
    // diagonal bounds.
    float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f};
    for (const QuadState& q : s.quads.span())
        for (int c = 0; c < 3 && q.guides > 0; ++c) {
            low[c] = std::min(low[c], q.bounds_min[c]);
            high[c] = std::max(high[c], q.bounds_max[c]);
        }
    for (int c = 0; c < 3; ++c) v.bounds_min[c] = low[c], v.bounds_max[c] = high[c];
    return v;
}

RigidTransform Simulation::guide_root(std::size_t lane_index) const {
    const State& s = *state_;
    const std::size_t stride = s.shape.one_motion ? 0 : kRootFloats * kTileLanes;
    const float* p = s.root_end.data() + lane_index / kTileLanes * stride + lane_index % kTileLanes;
    const auto at = [&](std::size_t c) { return double(p[c * kTileLanes]); };
    return {{at(4), at(5), at(6)}, {at(0), at(1), at(2), at(3)}};
}

const HealthCounters& Simulation::health() const { return state_->health; }

Stats Simulation::stats() const {
    const State& s = *state_;
    Stats stats;
    for (const PlannedPass& pass : s.plan.passes)
        stats.passes.push_back({pass.id, s.pass_seconds[std::size_t(pass.id)]});
    stats.step_seconds = s.step_seconds;
    stats.health = s.health;
    stats.bytes = s.plan.total_bytes();
    return stats;
}

void Simulation::reset_stats() {
    State& s = *state_;
    std::fill(std::begin(s.pass_seconds), std::end(s.pass_seconds), 0.0);
    s.step_seconds = 0;
    const std::uint32_t asleep = s.health.strands_asleep;
    s.health = {};
    s.health.strands_asleep = asleep;
}

std::uint64_t Simulation::position_hash() const {
    const State& s = *state_;
    // FNV-1a over 32-bit words.
    std::uint64_t hash = 14695981039346656037ull;
    const auto add = [&](std::uint32_t word) { hash = (hash ^ word) * 1099511628211ull; };
    const auto add_float = [&](float v) {
        std::uint32_t word;
        std::memcpy(&word, &v, 4);
        add(word);
    };
    if (s.position.size() > 0)
        for (std::size_t tile = 0; tile < s.shape.tiles; ++tile)
            for (std::size_t l = 0; l < kTileLanes; ++l)
                for (std::uint32_t p = 0; p < s.fields.guide_point_count[tile * kTileLanes + l];
                     ++p)
                    for (std::size_t c = 0; c < 3; ++c)
                        add_float(s.position[vector_index(s.tile_row(tile) + p, 3, c, l)]);
    if (s.strand_count > 0) {
        const std::size_t floats = std::size_t{s.fields.strand_first_point[s.strand_count]} * 3;
        for (std::size_t i = 0; i < std::min(floats, s.strand_position.size()); ++i)
            add_float(s.strand_position[i]);
        for (std::size_t i = 0; i < std::min(floats, s.strand_half.size()); ++i)
            add(s.strand_half[i]);
    }
    return hash;
}

namespace {

constexpr std::uint64_t kStateMark = 0x31305453'5453484bull;

// Runs through everything that a state holds, in a fixed order: one list for writing and reading.
template <class Visit>
void visit_state(Simulation::State& s, Visit&& visit) {
    const auto block = [&](auto& b) { visit(b.data(), b.size() * sizeof(b[0])); };
    visit(&s.time, sizeof s.time);
    visit(&s.previous_step, sizeof s.previous_step);
    visit(&s.first_step, sizeof s.first_step);
    visit(&s.disturbed, sizeof s.disturbed);
    visit(&s.strand_count, sizeof s.strand_count);
    visit(&s.settings.gravity, sizeof s.settings.gravity);
    visit(&s.settings.wind, sizeof s.settings.wind);
    visit(&s.settings.origin, sizeof s.settings.origin);
    visit(&s.health, sizeof s.health);
    visit(&s.motion_now, sizeof s.motion_now);
    visit(&s.motion_next, sizeof s.motion_next);
    block(s.bones_now);
    block(s.bones_next);
    block(s.bone_world);
    block(s.collider_now);
    block(s.collider_next);
    block(s.mesh_next);
    block(s.position);
    block(s.previous);
    block(s.root_begin);
    block(s.root_end);
    block(s.strand_root);
    block(s.quads);
}

// Whether a state that was read may go on: what the passes follow without looking is as it was in
// this simulation, and the inputs are numbers. Points need not be: what is not finite is put back
// to rest.
bool sound(const Simulation::State& s, std::span<const QuadState> quads) {
    const auto poses = [](std::span<const RigidTransform> all) {
        return std::ranges::all_of(all, [](const RigidTransform& t) { return finite(t); });
    };
    const auto numbers = [](const auto& all) {
        return std::ranges::all_of(all, [](double v) { return std::isfinite(v); });
    };
    const auto same = [](const QuadState& a, const QuadState& b) {
        return a.group_class == b.group_class && a.guides == b.guides;
    };
    const Wind& wind = s.settings.wind;
    return s.strand_count <= s.shape.strands && std::isfinite(s.time) &&
           std::isfinite(s.previous_step) && s.previous_step >= 0 && numbers(s.settings.gravity) &&
           numbers(wind.velocity) && wind.gust >= 0 && wind.gust <= 1 && wind.turbulence >= 0 &&
           wind.turbulence <= 1 && numbers(s.settings.origin) && finite(s.motion_now) &&
           finite(s.motion_next) && poses(s.bones_now) && poses(s.bones_next) &&
           poses(s.bone_world) && poses(s.collider_now) && poses(s.collider_next) &&
           numbers(s.mesh_next.span()) && std::ranges::equal(s.quads.span(), quads, same);
}

std::uint64_t identity(const Simulation::State& s) {
    std::uint64_t hash = 14695981039346656037ull;
    const auto add = [&](std::uint64_t v) { hash = (hash ^ v) * 1099511628211ull; };
    add(s.info.file_hash.low), add(s.info.file_hash.high);
    add(s.shape.rows), add(s.shape.tiles), add(s.shape.strands), add(s.shape.colliders);
    add(s.plan.iterations), add(s.shape.half), add(s.settings.seed);
    for (const PlannedPass& p : s.plan.passes) add(std::uint64_t(p.id) + 1);
    return hash;
}

}  // namespace

std::vector<std::byte> Simulation::save() const {
    State& s = *state_;
    std::size_t size = 2 * sizeof(std::uint64_t);
    visit_state(s, [&](const void*, std::size_t bytes) { size += bytes; });
    std::vector<std::byte> out(size);
    std::byte* at = out.data();
    const auto put = [&](const void* p, std::size_t bytes) {
        if (bytes > 0) std::memcpy(at, p, bytes);
        at += bytes;
    };
    const std::uint64_t head[2] = {kStateMark, identity(s)};
    put(head, sizeof head);
    visit_state(s, put);
    return out;
}

Result<void> Simulation::load(std::span<const std::byte> bytes) {
    State& s = *state_;
    std::size_t size = 2 * sizeof(std::uint64_t);
    visit_state(s, [&](const void*, std::size_t n) { size += n; });
    std::uint64_t head[2] = {};
    if (bytes.size() >= sizeof head) std::memcpy(head, bytes.data(), sizeof head);
    if (head[0] != kStateMark)
        return Error{ErrorCode::input, "state", "is not a saved state of a strand simulation"};
    if (head[1] != identity(s) || bytes.size() != size)
        return Error{ErrorCode::input, "state", "belongs to another asset or other settings"};
    const std::vector<std::byte> before = save();
    const std::vector<QuadState> quads(s.quads.span().begin(), s.quads.span().end());
    const auto take = [&](const std::byte* at) {
        visit_state(s, [&](void* p, std::size_t n) {
            if (n == sizeof(bool)) {
                *static_cast<bool*>(p) = *at != std::byte{0};
            } else if (n > 0) {
                std::memcpy(p, at, n);
            }
            at += n;
        });
    };
    take(bytes.data() + sizeof head);
    if (!sound(s, quads)) {
        take(before.data() + sizeof head);
        return Error{ErrorCode::input, "state", "holds numbers that no simulation has"};
    }
    write_strands(s);
    stand_still(s);
    return {};
}

}  // namespace keratin
