// A step: skin, grid, small steps quad by quad, render strands. Every loop over quads, bricks or
// strands may be shared between threads in any way: nothing depends on who does what.
#include "runtime/parallel.h"
#include "runtime/pass/ticks.h"
#include "runtime/state.h"
#include "schema/formula/interpolation.h"
#include "schema/material.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace keratin {

namespace {

using Clock = std::chrono::steady_clock;

// Adds what passes since its creation to a pass of a thread.
class Timed {
  public:
    Timed(Simulation::State& s, PassId pass)
        : slot_(s.times[worker_index()].ticks[std::size_t(pass)]), start_(ticks()) {}
    ~Timed() { slot_ += ticks() - start_; }

  private:
    std::uint64_t& slot_;
    std::uint64_t start_;
};

// Share of the air's drag on a fibre, per length and viscosity: 4 pi mu for a thin cylinder across
// the flow, its logarithm taken as one.
constexpr double kAirViscosity = 1.81e-5;  // Pa s
constexpr double kPi = 3.14159265358979323846;

// Relaxation time of bending (s), on top of the material's own 3 eta / E: moments follow the rate
// of bending as well as the bend. It takes little from the sway of a strand as a whole, but kinks
// that contacts and the length passes leave, which the direct solve would answer with as hard a
// kick back, die within a few small steps. At 1/240 s curls on a head still fluttered for ever.
constexpr double kBendRelaxation = 1.0 / 60;

// Largest push of the volume, in voxels per (1/60 s)^2 (METHODS 1.3).
constexpr float kVolumeLimit = 0.25f;

// How much further than in the last small step a root may go in one, in mean segments. Beyond, the
// first segments fold over before lengths and bending can pass the motion on, and a strand gains
// energy: with 3.4 segments 1.6 times its weight times its length, with 1.5 a 25th of that, with 1
// none. A steady motion, however fast, is none of this.
constexpr double kLongestKick = 1;
// At most this many times the small steps, so that no motion makes a step dear.
constexpr std::uint32_t kMostFiner = 4;

void fill_class(const Simulation::State& s, const Simulation::State::ClassKey& key, double h,
                double small, QuadClass& out) {
    const GroupInfo& group = s.info.groups[key.group];
    const StrandParameters& p = group.strand;
    const Material& m = group.material;
    const double area = kPi * m.radius * m.radius2;
    const double drag_rate = 4 * kPi * kAirViscosity / (double(m.density) * area);
    for (std::uint32_t row = 0; row < key.rows; ++row) {
        const double at = double(row) / (key.rows - 1);
        out.keep[row] = float(std::pow(1 - std::min(ramp_value(p.damping, at), 1.0), 60 * small));
        out.drag[row] = float(ramp_value(p.wind_response, at) * drag_rate);
        out.friction[row] = s.settings.passes.grid_friction
                                ? float(gain_per_step(std::min(ramp_value(p.friction, at), 1.0), h))
                                : 0.0f;
        out.volume[row] = s.settings.passes.grid_volume ? float(ramp_value(p.volume, at)) : 0.0f;
    }
    out.stiffness_step = float(small * small * bending_per_mass(m));
    for (int c = 0; c < 3; ++c) out.weight_step[c] = float(small * small) * s.settings.gravity[c];
    const double relaxation =
        kBendRelaxation + (m.youngs_modulus > 0 ? 3 * double(m.viscosity) / m.youngs_modulus : 0);
    out.bend_damping = float(relaxation / small);
    out.held = s.settings.passes.stretch ? 1.0f : 0.0f;
    const bool global = s.settings.passes.global_length;
    out.pull = global ? float(gain_per_step(std::min(double(p.global_length), 1.0), small)) : 0.0f;
    out.length_damping = global ? p.length_damping : 0.0f;
}

Quad quad_of(Simulation::State& s, std::size_t index, int thread) {
    const std::size_t tile = index * kQuadTiles;
    const std::size_t first = s.tile_row(tile);
    Quad q;
    q.rows = s.quad_rows(index);
    q.position = s.position.data() + first * 48;
    q.previous = s.previous.data() + first * 48;
    q.length = s.fields.guide_length.data() + first * 16;
    q.shape = s.fields.guide_shape.data() + first * 48;
    q.edge = s.rest_edge.data() + (s.rest_edge.size() > 0 ? first * 48 : 0);
    q.rest = s.fields.guide_position.data() + first * 48;
    q.filling_rest = s.filling_rest.size() > 0
                         ? s.filling_rest.data() + first * kFillingRestFloats * 16
                         : nullptr;
    q.root_stride = s.shape.one_motion ? 0 : kRootFloats * kTileLanes;
    q.root_begin = s.root_begin.data() + tile * q.root_stride;
    q.root_end = s.root_end.data() + tile * q.root_stride;
    q.group = &s.classes[s.quads[index].group_class];
    q.scratch = s.scratch.data() + std::size_t(thread) * s.scratch_stride;
    q.root_scratch = q.scratch + kScratchRow * std::size_t{s.shape.longest};
    q.near = s.near.data() + std::size_t(thread) * near_stride(s.shape.colliders);
    q.shapes = s.solids.data();
    q.collider_count = std::uint32_t(s.solids.size());
    const Wind& wind = s.settings.wind;
    q.flags.has_wind = wind.velocity[0] != 0 || wind.velocity[1] != 0 || wind.velocity[2] != 0;
    q.flags.has_turbulence = q.flags.has_wind && wind.turbulence > 0;
    q.flags.stretch = s.settings.passes.stretch;
    q.flags.local_shape = s.plan.has(PassId::local_shape);
    q.flags.collision = s.plan.has(PassId::collide);
    q.flags.final_length = s.plan.has(PassId::final_length);
    return q;
}

// Of a quad, all but the unit of displacements.
ScatterInput scatter_input(const Simulation::State& s, std::size_t quad, const GridShape& g) {
    const Material& m = s.info.groups[s.class_keys[s.quads[quad].group_class].group].material;
    const double strands_per_guide =
        s.info.guide_count > 0
            ? double(std::max(s.info.strand_count, s.info.guide_count)) / s.info.guide_count
            : 1;
    const float voxel = g.spacing * g.spacing * g.spacing;
    ScatterInput in;
    in.shape = g;
    in.mass_scale = s.inverse_mean_length;
    in.filling_scale =
        float(double(m.density) * kPi * m.radius * m.radius2 * strands_per_guide / double(voxel));
    in.mean_density = s.mean_density;
    in.point_count = s.fields.guide_point_count.data() + quad * kQuadLanes;
    in.density = s.fields.guide_density.empty()
                     ? nullptr
                     : s.fields.guide_density.data() + s.tile_row(quad * kQuadTiles) * 16;
    return in;
}

// Grid over the hair as it is now; returns whether anything is in it.
bool fill_grid(Simulation::State& s, GridView& view, double h) {
    float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f}, fastest = 0;
    for (const QuadState& q : s.quads.span()) {
        if (q.guides == 0) continue;
        for (int c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], q.bounds_min[c]);
            high[c] = std::max(high[c], q.bounds_max[c]);
        }
        fastest = std::max(fastest, q.fastest);
    }
    if (!(low[0] <= high[0]) || !(fastest < 1e3f)) return false;
    const std::uint32_t along = s.shape.grid_bricks_along;
    GridShape& g = view.shape;
    for (int c = 0; c < 3; ++c) g.bricks[c] = along;
    // Half as long again as the groom at rest, about the middle of the hair, on whole voxels of the
    // asset.
    float side = 0;
    for (int c = 0; c < 3; ++c) side = std::max(side, s.info.bounds_max[c] - s.info.bounds_min[c]);
    g.spacing = 1.5f * std::max(side, 1e-3f) / float(along * kBrickSide);
    g.inverse_spacing = 1 / g.spacing;
    const Vec4d turn = conjugate(rotation_of(s.motion_now));
    for (int c = 0; c < 3; ++c) {
        const Vec3d column = rotate(turn, Vec3d(c == 0, c == 1, c == 2));
        g.to_own[c] = float(column.x), g.to_own[c + 3] = float(column.y);
        g.to_own[c + 6] = float(column.z);
        g.place[c] = float(s.motion_now.translation[c] - s.settings.origin[c]);
    }
    const auto middle = [&](int c) { return (double(low[c]) + high[c]) / 2 - double(g.place[c]); };
    const Vec3d own = rotate(turn, Vec3d(middle(0), middle(1), middle(2)));
    const double center[3] = {own.x, own.y, own.z};
    for (int c = 0; c < 3; ++c)
        g.origin[c] =
            float(std::floor(center[c] * double(g.inverse_spacing) - 0.5 * (along * kBrickSide))) *
            g.spacing;

    const float unit = std::max(std::sqrt(fastest), 1e-9f);
    const std::size_t bricks = g.brick_count();
    std::vector<GridSums>& sums = s.grid_sums;
    share(s.settings.host, s.threads, s.quads.size(), 2, [&](std::size_t i) {
        if (s.quads[i].guides == 0) return;
        Timed timed(s, PassId::grid_scatter);
        ScatterInput in = scatter_input(s, i, g);
        in.inverse_displacement_unit = 1 / unit;
        s.kernels->grid_scatter(quad_of(s, i, int(worker_index())), in, sums[worker_index()]);
    });
    const std::size_t even = even_grain(bricks, s.threads);
    // A point's eight voxels lie in the brick of the lowest or in the next along each axis.
    share(s.settings.host, s.threads, bricks, even, [&](std::size_t b) {
        const std::size_t x = b % along, y = b / along % along, z = b / along / along;
        std::uint8_t live = 0;
        for (std::size_t k = 0; k < 8; ++k) {
            const std::size_t dx = k & 1, dy = k >> 1 & 1, dz = k >> 2;
            if (x < dx || y < dy || z < dz) continue;
            const std::size_t from = b - dx - along * (dy + along * dz);
            for (std::size_t t = 0; t < sums.size(); ++t) live |= sums[t].touched[from];
        }
        s.grid_live[b] = live;
        if (!live) return;
        Timed timed(s, PassId::grid_resolve);
        s.kernels->grid_resolve(sums.data(), std::uint32_t(sums.size()), b, unit,
                                s.grid_field.data());
    });
    for (GridSums& sum : sums) std::memset(sum.touched, 0, bricks);
    view.field = s.grid_field.data();
    view.step = float(h);
    view.previous_step = float(s.previous_step);
    view.friction = s.shape.friction;
    view.volume = s.shape.volume;
    view.limit = kVolumeLimit * g.spacing * 3600.0f;
    return true;
}

bool root_still(const Simulation::State& s, std::size_t quad) {
    const std::size_t stride = s.shape.one_motion ? 0 : kRootFloats * kTileLanes;
    const std::size_t floats = s.shape.one_motion ? kRootFloats * kTileLanes : stride * kQuadTiles;
    const float* a = s.root_begin.data() + quad * kQuadTiles * stride;
    const float* b = s.root_end.data() + quad * kQuadTiles * stride;
    return std::memcmp(a, b, floats * sizeof(float)) == 0;
}

bool boxes_meet(const float* a_min, const float* a_max, const float* b_min, const float* b_max,
                float margin) {
    for (int c = 0; c < 3; ++c)
        if (a_max[c] + margin < b_min[c] || b_max[c] + margin < a_min[c]) return false;
    return true;
}

// A sleeping quad wakes when a root or a collider at it moves, the air does, or awake hair that it
// shares the grid with moves near it.
void wake(Simulation::State& s) {
    constexpr float kNear = 0.02f;  // m
    const Wind& wind = s.settings.wind;
    const bool windy = wind.velocity[0] != 0 || wind.velocity[1] != 0 || wind.velocity[2] != 0;
    const bool grid = s.plan.has(PassId::grid_gather);
    for (std::size_t i = 0; i < s.quads.size(); ++i) {
        QuadState& q = s.quads[i];
        if (!q.asleep) continue;
        bool moved = windy || s.disturbed || !root_still(s, i);
        for (std::size_t k = 0; k < s.solids.size() && !moved; ++k) {
            if (s.collider_now[k] == s.collider_next[k]) continue;
            float low[3], high[3];
            sweep(s, k, low, high);
            moved = boxes_meet(q.bounds_min, q.bounds_max, low, high, kNear);
        }
        for (std::size_t j = 0; j < s.quads.size() && grid && !moved; ++j) {
            const QuadState& other = s.quads[j];
            const float limit = 4 * s.settings.sleep_speed * float(s.previous_step);
            moved = !other.asleep && other.guides > 0 && other.fastest > limit * limit &&
                    boxes_meet(q.bounds_min, q.bounds_max, other.bounds_min, other.bounds_max, 0);
        }
        if (moved) q.asleep = 0, q.quiet = 0;
    }
    s.disturbed = false;
}

void run_quad(Simulation::State& s, std::size_t index, const SmallStep* steps, std::uint32_t count,
              const GridView* grid, bool last, double h) {
    QuadState& state = s.quads[index];
    if (state.guides == 0 || state.asleep) return;
    const SmallAsZero flush;
    Quad quad = quad_of(s, index, int(worker_index()));
    const KernelTable& k = *s.kernels;
    if (grid) {
        Timed timed(s, PassId::grid_gather);
        k.grid_gather(quad, *grid);
    }
    SweepTicks sweeps;
    quad.ticks = &sweeps;
    k.small_steps(quad, steps, count);
    // A sweep that serves several passes counts for the one that asks for most of it.
    const auto first_of = [&](PassId a, PassId b) { return s.plan.has(a) ? a : b; };
    std::uint64_t* times = s.times[worker_index()].ticks;
    times[std::size_t(PassId::integrate)] += sweeps.prepare;
    times[std::size_t(first_of(PassId::local_shape, PassId::integrate))] += sweeps.predict;
    times[std::size_t(first_of(PassId::stretch, PassId::integrate))] += sweeps.tense;
    times[std::size_t(first_of(PassId::final_length,
                               first_of(PassId::stretch, PassId::integrate)))] += sweeps.settle;
    if (!last) return;

    Timed timed(s, PassId::integrate);
    std::uint64_t bad = k.check(quad);
    if (bad) {
        std::uint64_t count_bad = 0;
        for (std::size_t lane = 0; lane < kQuadLanes; ++lane) {
            if (!(bad >> lane & 1)) continue;
            put_to_rest(s, index * kQuadTiles + lane / kTileLanes, lane % kTileLanes);
            if (s.fields.guide_point_count[index * kQuadLanes + lane] > 0) ++count_bad;
        }
        std::atomic_ref(s.health.strands_reset).fetch_add(count_bad);
        k.check(quad);
    }
    std::copy(quad.bounds_min, quad.bounds_min + 3, state.bounds_min);
    std::copy(quad.bounds_max, quad.bounds_max + 3, state.bounds_max);
    state.fastest = quad.fastest;

    if (s.settings.sleep_speed > 0) {
        const float limit = s.settings.sleep_speed / steps[count - 1].inverse_step;
        const bool still = quad.fastest < limit * limit && root_still(s, index);
        state.quiet = still ? state.quiet + float(h) : 0;
        if (state.quiet > 0.5f) {
            state.asleep = 1;
            const std::size_t floats = std::size_t{quad.rows} * kQuadTiles * 48;
            std::memcpy(quad.previous, quad.position, floats * sizeof(float));
            state.fastest = 0;
        }
    }
}

void add_times(Simulation::State& s, std::uint64_t elapsed_ticks, double elapsed) {
    const double per_tick = elapsed_ticks > 0 ? elapsed / double(elapsed_ticks) : 0;
    for (Simulation::State::ThreadTimes& t : s.times)
        for (std::size_t p = 0; p < kPassCount; ++p) {
            s.pass_seconds[p] += double(t.ticks[p]) * per_tick;
            t.ticks[p] = 0;
        }
    s.step_seconds += elapsed;
}

}  // namespace

void measure_quads(Simulation::State& s) {
    for (std::size_t i = 0; i < s.quads.size(); ++i) {
        QuadState& q = s.quads[i];
        if (q.guides == 0) continue;
        const std::size_t first = s.tile_row(i * kQuadTiles) * 48;
        const std::size_t rows = std::size_t{s.quad_rows(i)} * kQuadTiles;
        float fastest = 0;
        for (int c = 0; c < 3; ++c) q.bounds_min[c] = 1e30f, q.bounds_max[c] = -1e30f;
        for (std::size_t row = 0; row < rows; ++row)
            for (std::size_t l = 0; l < kTileLanes; ++l) {
                float square = 0;
                for (int c = 0; c < 3; ++c) {
                    const std::size_t at = first + row * 48 + std::size_t(c) * 16 + l;
                    const float x = s.position[at], d = x - s.previous[at];
                    q.bounds_min[c] = std::min(q.bounds_min[c], x);
                    q.bounds_max[c] = std::max(q.bounds_max[c], x);
                    square += d * d;
                }
                fastest = std::max(fastest, square);
            }
        q.fastest = fastest;
        q.quiet = 0;
        q.asleep = 0;
    }
}

void measure_filling(Simulation::State& s) {
    GridView grid;
    if (!fill_grid(s, grid, 1)) return;
    for (std::size_t i = 0; i < s.quads.size(); ++i)
        if (s.quads[i].guides > 0)
            s.kernels->grid_at_rest(
                quad_of(s, i, 0), scatter_input(s, i, grid.shape), grid,
                s.filling_rest.data() + s.tile_row(i * kQuadTiles) * kFillingRestFloats * 16);
    // making is no part of a step
    for (Simulation::State::ThreadTimes& t : s.times) t = {};
}

void write_strands(Simulation::State& s) {
    const bool carry = s.plan.has(PassId::carry);
    if ((!carry && !s.plan.has(PassId::interpolate)) || s.strand_count == 0) return;
    StrandBatch b;
    b.first_point = s.fields.strand_first_point.data();
    b.points = s.fields.strand_position.size() / 3;
    b.rest = s.fields.strand_position.data();
    b.fraction = s.fields.strand_fraction.empty() ? nullptr : s.fields.strand_fraction.data();
    b.guide = s.fields.strand_guide.data();
    b.weight = s.fields.strand_weight.data();
    b.root = s.strand_root.data();
    b.root_stride = s.shape.one_motion ? 0 : kRootFloats;
    b.line = carry ? nullptr : s.line.data();
    b.tile_first_row = s.fields.tile_first_row.data();
    b.guide_point_count = s.fields.guide_point_count.data();
    b.guide_strand = s.fields.guide_strand.data();
    b.position = s.strand_position.size() ? s.strand_position.data() : nullptr;
    b.half = s.strand_half.size() ? s.strand_half.data() : nullptr;
    b.tangent = s.strand_tangent.size() ? s.strand_tangent.data() : nullptr;
    // Half floats keep eleven bits: count them from the middle of the body.
    const Vec3d middle(0.5 * (double(s.info.bounds_min[0]) + s.info.bounds_max[0]),
                       0.5 * (double(s.info.bounds_min[1]) + s.info.bounds_max[1]),
                       0.5 * (double(s.info.bounds_min[2]) + s.info.bounds_max[2]));
    const Vec3d place = rotate(rotation_of(s.motion_next), middle) + translation_of(s.motion_next);
    s.half_center = {float(place.x - s.settings.origin[0]), float(place.y - s.settings.origin[1]),
                     float(place.z - s.settings.origin[2])};
    std::copy(s.half_center.begin(), s.half_center.end(), b.half_center);
    // Past the cache once the output is larger than a core's share of it.
    constexpr std::size_t kStreamBytes = std::size_t{16} << 20;
    b.stream = std::size_t{s.shape.points} * 3 * (s.shape.half ? 2 : 4) > kStreamBytes;

    constexpr std::uint32_t kStrands = 256;
    const std::uint32_t batches = (s.strand_count + kStrands - 1) / kStrands;
    const PassId pass = carry ? PassId::carry : PassId::interpolate;
    if (!carry)
        share(s.settings.host, s.threads, s.quads.size(), 8, [&](std::size_t i) {
            if (s.quads[i].guides == 0) return;
            Timed timed(s, pass);
            s.kernels->guide_lines(quad_of(s, i, int(worker_index())),
                                   s.line.data() + s.tile_row(i * kQuadTiles) * 48);
        });
    share(s.settings.host, s.threads, batches, 4, [&](std::size_t i) {
        Timed timed(s, pass);
        const auto first = std::uint32_t(i) * kStrands;
        s.kernels->interpolate(b, first, std::min(s.strand_count, first + kStrands));
    });
}

Result<void> advance(Simulation::State& s, double h) {
    if (!(h >= 1e-5 && h <= 0.25))
        return Error{ErrorCode::input, "step", "must be between 1e-5 and 0.25 s; cut longer ones"};
    const auto start = Clock::now();
    const std::uint64_t start_ticks = ticks();

    pose_bones(s);
    if (s.simulated()) {
        {
            Timed timed(s, PassId::skin);
            skin_guides(s);
            s.health.strands_teleported += carry_jumps(s, false, Velocity::keep);
        }
        // Asset colliders follow their bone.
        for (std::size_t i = s.settings.colliders.size(); i < s.solids.size(); ++i) {
            const std::uint32_t bone = asset_collider_bone(s.info, i - s.settings.colliders.size());
            s.collider_next[i] = s.bone_world[bone < s.bone_world.size() ? bone : 0];
        }
        const double wanted = 60.0 * h * s.plan.iterations;
        auto n = std::max(1u, std::uint32_t(std::ceil(wanted - 1e-6)));
        // Small steps in which roots take up a new velocity no faster than the hair can follow.
        const double kicked = root_kick(s, h) * h * s.inverse_mean_length / kLongestKick;
        if (kicked > n)
            n = std::min(kMostFiner * n, std::uint32_t(std::ceil(std::min(kicked, 1e6))));
        double thrown = 0;
        if (s.plan.has(PassId::collide))
            if (const SolidSteps solid = steps_for_solids(s); solid.count > n)
                n = solid.count, thrown = solid.way;
        const double small = h / n;
        if (s.first_step) s.previous_step = small;

        for (std::size_t c = 0; c < s.class_keys.size(); ++c)
            fill_class(s, s.class_keys[c], h, small, s.classes[c]);

        GridView grid;
        const bool with_grid =
            s.plan.has(PassId::grid_gather) && !s.first_step && fill_grid(s, grid, h);

        SmallStep steps[kStepsAtOnce];
        double before = s.previous_step;
        for (std::uint32_t first = 0; first < n; first += kStepsAtOnce) {
            const std::uint32_t count = std::min(kStepsAtOnce, n - first);
            pose_solids(s, first, count, n);
            if (first == 0 && s.settings.sleep_speed > 0) wake(s);
            for (std::uint32_t i = 0; i < count; ++i) {
                SmallStep& step = steps[i];
                step.fraction = first + i + 1 == n ? 1.0f : float(double(first + i + 1) / n);
                step.fraction_before = float(double(first + i) / n);
                step.step_ratio = float(small / before);
                // From rest x- = x stands for the x- = x + a h^2 / 2 of METHODS 1.3.
                const double half_square = s.first_step && first + i == 0
                                               ? small * small / 2
                                               : small * (small + before) / 2;
                step.half_square = float(half_square);
                step.elastic_share = float(half_square / (small * small));
                step.inverse_step = float(1 / small);
                step.thrown = float(thrown / n);
                step.inverse_previous = float(1 / before);
                for (int c = 0; c < 3; ++c) step.gravity[c] = s.settings.gravity[c];
                wind_at(s, s.time + h * (first + i + 0.5) / n, step);
                step.colliders = s.poses.data() + i * s.solids.size();
                before = small;
            }
            share(s.settings.host, s.threads, s.quads.size(), 1, [&](std::size_t q) {
                run_quad(s, q, steps, count, with_grid && first == 0 ? &grid : nullptr,
                         first + count == n, h);
            });
        }
        s.previous_step = small;
        s.health.small_steps += n;
        s.first_step = false;
        std::uint32_t asleep = 0;
        for (const QuadState& q : s.quads.span()) asleep += q.asleep ? q.guides : 0;
        s.health.strands_asleep = asleep;
        std::copy(s.root_end.span().begin(), s.root_end.span().end(), s.root_begin.data());
    }
    if (s.strand_root.size() > 0) {
        Timed timed(s, PassId::skin);
        skin_strands(s);
    }
    write_strands(s);

    s.motion_now = s.motion_next;
    std::copy(s.bones_next.begin(), s.bones_next.end(), s.bones_now.begin());
    std::copy(s.collider_next.begin(), s.collider_next.end(), s.collider_now.begin());
    s.time += h;
    ++s.health.steps;
    add_times(s, ticks() - start_ticks,
              std::chrono::duration<double>(Clock::now() - start).count());
    return {};
}

}  // namespace keratin
