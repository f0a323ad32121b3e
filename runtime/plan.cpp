#include "runtime/plan.h"

#include "runtime/buffers.h"
#include "runtime/pass/strands.h"
#include "runtime/passes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <omp.h>
#include <utility>

namespace keratin {

namespace {

bool any_above_zero(const AssetInfo& info, Ramp StrandParameters::*ramp) {
    for (const GroupInfo& group : info.groups)
        for (float value : group.strand.*ramp)
            if (value > 0) return true;
    return false;
}

bool finite(std::span<const float> values) {
    return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
}

Error bad(std::string where, std::string message) {
    return {ErrorCode::input, std::move(where), std::move(message)};
}

Result<void> check_collider(const Collider& c, const std::string& where) {
    const auto positive = [&](float v, const char* name) -> Result<void> {
        if (!(v > 0) || !std::isfinite(v))
            return bad(where + "." + name, "must be a number above 0");
        return {};
    };
    if (!(c.friction >= 0) || !std::isfinite(c.friction))
        return bad(where + ".friction", "must be a number of at least 0");
    if (!(c.contact_distance >= 0) || !std::isfinite(c.contact_distance))
        return bad(where + ".contact_distance", "must be a number of at least 0 (m)");
    if (const auto* s = std::get_if<SphereCollider>(&c.shape)) {
        if (!finite(s->center)) return bad(where + ".center", "must be finite");
        return positive(s->radius, "radius");
    }
    if (const auto* s = std::get_if<CapsuleCollider>(&c.shape)) {
        if (!finite(s->a) || !finite(s->b)) return bad(where + ".a, .b", "must be finite");
        return positive(s->radius, "radius");
    }
    if (const auto* s = std::get_if<BoxCollider>(&c.shape)) {
        if (!finite(s->center)) return bad(where + ".center", "must be finite");
        for (float v : s->half_size)
            if (auto r = positive(v, "half_size"); !r) return r;
        return {};
    }
    if (const auto* s = std::get_if<PlaneCollider>(&c.shape)) {
        if (!finite(s->point) || !finite(s->normal)) return bad(where, "must be finite");
        const float n = std::hypot(s->normal[0], s->normal[1], s->normal[2]);
        if (!(std::fabs(n - 1) < 1e-3f)) return bad(where + ".normal", "must be of unit length");
        return {};
    }
    const auto& grid = std::get<DistanceGridCollider>(c.shape).grid;
    if (!grid) return bad(where + ".grid", "is missing");
    std::uint64_t nodes = 1;
    for (std::uint32_t n : grid->nodes) {
        if (n < 2 || n > 4096)
            return bad(where + ".grid.nodes", "must be 2 to 4096 along each axis");
        nodes *= n;
    }
    if (nodes > std::numeric_limits<std::uint32_t>::max())
        return bad(where + ".grid.nodes", "must be fewer than 2^32 in all");
    if (grid->distance.size() != nodes)
        return bad(where + ".grid.distance", "must have one value a node");
    if (!finite(grid->distance) || !finite(grid->origin))
        return bad(where + ".grid", "must be finite");
    return positive(grid->spacing, "grid.spacing");
}

// What a material must be for the solver; an asset file was held to it when it was opened.
Result<void> check_groups(const AssetInfo& info) {
    for (std::size_t i = 0; i < info.groups.size(); ++i) {
        const Material& m = info.groups[i].material;
        const std::string where = "groups[" + std::to_string(i) + "].material.";
        const std::pair<const char*, float> positive[] = {
            {"radius", m.radius}, {"radius2", m.radius2}, {"density", m.density}};
        for (const auto& [name, value] : positive)
            if (!(value > 0) || !std::isfinite(value))
                return bad(where + name, "must be a number above 0");
        if (!(m.youngs_modulus >= 0) || !std::isfinite(m.youngs_modulus))
            return bad(where + "youngs_modulus", "must be a number of at least 0");
    }
    return {};
}

// A hundredth of the mean: the bending of shorter ones next to longer ones is beyond a step.
constexpr double kShortestSegment = 0.01;

Result<void> check_guide(const AssetInfo& info, const AssetFields& fields, std::size_t lane) {
    const std::uint32_t n = fields.guide_point_count[lane];
    if (n == 0 || info.attach == Attach::all) return {};
    const std::string where = "guide " + std::to_string(lane);
    if (n < kStrandMinPoints || n > kStrandMaxPoints)
        return Error{ErrorCode::unsupported, where,
                     "has " + std::to_string(n) +
                         " points; the strand solver takes 3 to 32 (recipe: points_per_strand)"};
    const std::size_t first = fields.tile_first_row[lane / kTileLanes], l = lane % kTileLanes;
    double sum = 0, shortest = std::numeric_limits<double>::max();
    for (std::uint32_t p = 0; p < n; ++p) {
        for (std::size_t c = 0; c < 3; ++c)
            if (!std::isfinite(fields.guide_position[vector_index(first + p, 3, c, l)]) ||
                !std::isfinite(fields.guide_shape[vector_index(first + p, 3, c, l)]))
                return bad(where + ", point " + std::to_string(p), "must be finite");
        if (p == 0) continue;
        const double length = double(fields.guide_length[scalar_index(first + p, l)]);
        if (!(length >= 0) || !std::isfinite(length))
            return bad(where + ", segment " + std::to_string(p), "must have a finite length");
        sum += length;
        shortest = std::min(shortest, length);
    }
    if (shortest < kShortestSegment * sum / (n - 1)) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "has a segment of %.3g m where the mean is %.3g m; the strand solver takes "
                      "segments of at least a hundredth of it (recipe: points_per_strand)",
                      shortest, sum / (n - 1));
        return Error{ErrorCode::unsupported, where, text};
    }
    return {};
}

Result<void> check_settings(const AssetInfo& info, const AssetFields& fields,
                            const Settings& settings) {
    if (!finite(settings.gravity)) return bad("gravity", "must be finite");
    if (!finite(settings.wind.velocity)) return bad("wind.velocity", "must be finite");
    if (!(settings.wind.gust >= 0 && settings.wind.gust <= 1))
        return bad("wind.gust", "must be between 0 and 1");
    if (!(settings.wind.turbulence >= 0 && settings.wind.turbulence <= 1))
        return bad("wind.turbulence", "must be between 0 and 1");
    if (settings.iterations > 64) return bad("iterations", "must be 1 to 64, or 0 for the asset's");
    if (settings.threads < 0 || settings.threads > 1024) return bad("threads", "must be 0 to 1024");
    if (!(settings.lod >= 0 && settings.lod <= 1)) return bad("lod", "must be between 0 and 1");
    if (settings.grid_resolution < 8 || settings.grid_resolution > 128)
        return bad("grid_resolution", "must be 8 to 128");
    if (!std::isfinite(settings.teleport_distance))
        return bad("teleport_distance", "must be finite");
    if (!std::isfinite(settings.sleep_speed)) return bad("sleep_speed", "must be finite");
    if (!settings.host.allocate != !settings.host.release)
        return bad("host", "must give both allocate and release, or neither");
    for (double v : settings.origin)
        if (!std::isfinite(v)) return bad("origin", "must be finite");
    for (std::size_t i = 0; i < settings.colliders.size(); ++i)
        if (auto r = check_collider(settings.colliders[i], "colliders[" + std::to_string(i) + "]");
            !r)
            return r;
    if (settings.instruction_set != InstructionSet::automatic &&
        usable_instruction_set(settings.instruction_set) != settings.instruction_set)
        return Error{ErrorCode::unsupported, "instruction_set", "is missing on this processor"};
    if (info.tile_count % kQuadTiles != 0) return bad("tile_count", "must be a multiple of 4");
    if (auto r = check_groups(info); !r) return r;
    for (std::size_t lane = 0; lane < fields.guide_point_count.size(); ++lane)
        if (auto r = check_guide(info, fields, lane); !r) return r;
    if (info.attach == Attach::triangle &&
        (fields.guide_triangle.empty() || fields.mesh_position.empty()))
        return bad("attach", "triangle needs the mesh and the roots' triangles in the asset");
    return {};
}

struct Need {
    bool wanted = false;
    std::string reason;  // why not
};

}  // namespace

std::size_t asset_collider_count(const AssetInfo& info) {
    return info.distance_grid.stored_bricks > 0 ? 1 : info.colliders.size();
}

std::uint32_t asset_collider_bone(const AssetInfo& info, std::size_t index) {
    return info.distance_grid.stored_bricks > 0 ? info.distance_grid.bone
                                                : info.colliders[index].bone;
}

int thread_count(int wanted) { return wanted > 0 ? wanted : omp_get_max_threads(); }

RunShape run_shape(const AssetInfo& info, const AssetFields& fields, const Settings& settings) {
    RunShape s;
    s.simulated = info.attach != Attach::all;
    s.tiles = info.tile_count;
    s.quads = info.tile_count / kQuadTiles;
    s.rows = info.row_count;
    for (std::uint32_t t = 0; t < info.tile_count; ++t)
        s.longest = std::max(s.longest, fields.tile_first_row[t + 1] - fields.tile_first_row[t]);
    s.bones = std::uint32_t(info.bones.size());
    s.by_triangle = info.attach == Attach::triangle;
    s.vertices = s.by_triangle ? info.vertex_count : 0;
    s.one_motion = !s.by_triangle && info.bones.empty();
    s.colliders = std::uint32_t(settings.colliders.size() +
                                (settings.asset_colliders ? asset_collider_count(info) : 0));
    s.threads = std::uint32_t(thread_count(settings.threads));
    s.strands = std::uint32_t(std::floor(double(info.strand_count) * double(settings.lod) + 1e-6));
    s.points = s.strands == 0 ? 0 : fields.strand_first_point[s.strands];
    s.friction = settings.passes.grid_friction && any_above_zero(info, &StrandParameters::friction);
    s.volume = settings.passes.grid_volume && any_above_zero(info, &StrandParameters::volume);
    s.half = settings.output == OutputPrecision::float16;
    s.tangents = settings.tangents;
    s.previous = settings.previous;
    s.grid_bricks_along = (settings.grid_resolution + kBrickSide - 1) / kBrickSide;
    s.classes = s.quads;
    return s;
}

bool SolverPlan::has(PassId pass) const {
    return std::ranges::any_of(passes, [&](const PlannedPass& p) { return p.id == pass; });
}
bool SolverPlan::has(BufferId buffer) const {
    return std::ranges::any_of(buffers, [&](const PlannedBuffer& b) { return b.id == buffer; });
}
std::uint64_t SolverPlan::bytes(BufferId buffer) const {
    for (const PlannedBuffer& b : buffers)
        if (b.id == buffer) return b.bytes;
    return 0;
}
std::uint64_t SolverPlan::total_bytes() const {
    std::uint64_t sum = 0;
    for (const PlannedBuffer& b : buffers) sum += b.bytes;
    return sum;
}

namespace {

std::uint64_t buffer_bytes(BufferId id, const RunShape& s) {
    const std::uint64_t point_lanes = std::uint64_t{s.rows} * kTileLanes;
    const std::uint64_t bricks =
        std::uint64_t{s.grid_bricks_along} * s.grid_bricks_along * s.grid_bricks_along;
    switch (id) {
        case BufferId::rest_edge:
        case BufferId::position:
        case BufferId::previous:
            return point_lanes * 3 * sizeof(float);
        case BufferId::filling_rest:
            return s.volume ? point_lanes * kFillingRestFloats * sizeof(float) : 0;
        case BufferId::root:
            return (s.one_motion ? 1 : std::uint64_t{s.tiles}) * 2 * 7 * kTileLanes * sizeof(float);
        case BufferId::bone_pose:
            return std::uint64_t{s.bones} * 3 * sizeof(RigidTransform);
        case BufferId::mesh_position:
            return std::uint64_t{s.vertices} * 3 * sizeof(float);
        case BufferId::triangle_slot:
            return ((s.simulated ? std::uint64_t{s.tiles} * kTileLanes : 0) + s.strands) *
                   sizeof(std::uint32_t);
        case BufferId::grid_sum:
            return s.threads * bricks * kBrickVoxels * ((s.friction ? 4 : 0) + (s.volume ? 1 : 0)) *
                   sizeof(std::int64_t);
        case BufferId::grid_field:
            return bricks * kBrickVoxels * grid_field_floats(s.friction) * sizeof(float);
        case BufferId::grid_brick:
            return (s.threads + 1) * bricks;
        case BufferId::collider:
            return s.colliders * (sizeof(ColliderShapeData) + kStepsAtOnce * sizeof(ColliderPose) +
                                  2 * sizeof(RigidTransform));
        case BufferId::strand_root:
            return (s.one_motion ? 1 : std::uint64_t{s.strands}) * 7 * sizeof(float);
        case BufferId::guide_line:
            return (point_lanes * 3 + kLineBehind) * sizeof(float);
        case BufferId::strand_position:
            return std::uint64_t{s.points} * 3 * (s.half ? 2 : sizeof(float));
        case BufferId::strand_tangent:
            return s.tangents ? std::uint64_t{s.points} * 3 * sizeof(float) : 0;
        case BufferId::strand_previous:
            return s.previous ? std::uint64_t{s.points} * 3 * (s.half ? 2 : sizeof(float)) : 0;
        case BufferId::quad_state:
            return s.quads * (sizeof(QuadClass) + 64);
        case BufferId::scratch:
            return std::uint64_t{s.threads} *
                   ((kScratchRow * std::uint64_t{s.longest} + root_slot_count * kBlockLanes) *
                        sizeof(float) +
                    near_stride(s.colliders) * sizeof(std::uint32_t));
    }
    return 0;
}

}  // namespace

Result<SolverPlan> make_plan(const AssetInfo& info, const AssetFields& fields,
                             const Settings& settings) {
    if (auto r = check_settings(info, fields, settings); !r) return r.error();
    const RunShape shape = run_shape(info, fields, settings);
    const PassSwitches& on = settings.passes;

    Need simulate{shape.simulated && info.guide_count > 0,
                  shape.simulated ? "the asset has no guides"
                                  : "attach is `all`: every point follows its root"};
    Need grid{simulate.wanted && (shape.friction || shape.volume), ""};
    if (!simulate.wanted)
        grid.reason = simulate.reason;
    else if (!on.grid_friction || !on.grid_volume)
        grid.reason = "friction or volume switched off, the other 0 in every group or off";
    else
        grid.reason = "no friction and no volume in any group";

    const auto stiff = [&] {
        return std::ranges::any_of(
            info.groups, [](const GroupInfo& g) { return g.material.youngs_modulus > 0; });
    };
    const auto needs = [&](PassId id) -> Need {
        switch (id) {
            case PassId::skin:
                return {!shape.one_motion,
                        "no bones and no triangles: one motion carries every root"};
            case PassId::grid_scatter:
            case PassId::grid_resolve:
            case PassId::grid_gather:
                return grid;
            case PassId::integrate:
                return simulate;
            case PassId::local_shape:
                if (!simulate.wanted) return simulate;
                if (!on.local_shape) return {false, "switched off"};
                return {stiff(), "Young's modulus is 0 in every group"};
            case PassId::stretch:
                if (!simulate.wanted) return simulate;
                return {on.stretch || on.global_length, "switched off"};
            case PassId::collide:
                if (!simulate.wanted) return simulate;
                if (shape.colliders == 0) return {false, "no colliders"};
                return {on.collision, "switched off"};
            case PassId::final_length:
                if (!simulate.wanted) return simulate;
                return {on.global_length, "switched off"};
            case PassId::carry:
                if (shape.simulated) return {false, "attach is not `all`: strands are simulated"};
                return {shape.strands > 0, "no render strands"};
            case PassId::interpolate:
                if (!shape.simulated) return {false, "attach is `all`: strands are carried"};
                if (!on.interpolation) return {false, "switched off"};
                return {shape.strands > 0 && simulate.wanted, "no render strands"};
        }
        return {};
    };

    SolverPlan plan;
    for (const GroupInfo& group : info.groups)
        plan.iterations = std::max(plan.iterations, group.strand.iterations);
    if (settings.iterations > 0) plan.iterations = settings.iterations;
    plan.iterations = std::clamp(plan.iterations, 1u, 64u);

    std::array<bool, kBufferCount> used{};
    for (const PassEntry& entry : pass_table()) {
        const Need need = needs(entry.id);
        if (!need.wanted) {
            plan.left_out.push_back({std::string(entry.name), need.reason});
            continue;
        }
        PlannedPass pass{entry.id, {}};
        for (BufferId id : entry.buffers) {
            // A pass that serves several ways of attaching touches only what this asset has.
            if (buffer_bytes(id, shape) == 0) continue;
            if (id == BufferId::root && !shape.simulated) continue;
            if (id == BufferId::strand_root && shape.strands == 0) continue;
            if (id == BufferId::triangle_slot && !shape.by_triangle) continue;
            pass.buffers.push_back(id);
            used[std::size_t(id)] = true;
        }
        plan.passes.push_back(std::move(pass));
    }
    for (std::size_t i = 0; i < kBufferCount; ++i) {
        const BufferId id = BufferId(i);
        if (used[i])
            plan.buffers.push_back({id, buffer_bytes(id, shape)});
        else
            plan.left_out.push_back(
                {"buffer " + std::string(name_of(id)), "no planned pass touches it"});
    }
    return plan;
}

std::string explain(const SolverPlan& plan) {
    std::string text = "passes, in order (" + std::to_string(plan.iterations) +
                       " constraint iterations per 1/60 s):\n";
    for (const PlannedPass& pass : plan.passes) {
        text += "  " + std::string(name_of(pass.id)) + ":";
        for (BufferId id : pass.buffers) text += " " + std::string(name_of(id));
        text += '\n';
    }
    text += "buffers:\n";
    char line[96];
    for (const PlannedBuffer& buffer : plan.buffers) {
        std::snprintf(line, sizeof line, "  %-16s %12llu bytes\n",
                      std::string(name_of(buffer.id)).c_str(),
                      static_cast<unsigned long long>(buffer.bytes));
        text += line;
    }
    std::snprintf(line, sizeof line, "  %-16s %12llu bytes\n", "total",
                  static_cast<unsigned long long>(plan.total_bytes()));
    text += line;
    text += "left out:\n";
    for (const LeftOut& left : plan.left_out) text += "  " + left.name + ": " + left.reason + '\n';
    return text;
}

}  // namespace keratin
