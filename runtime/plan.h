// The plan: which passes a scene needs, which buffers these touch, and why everything else is left
// out. Made before anything is allocated; Simulation allocates what it lists and nothing more.
#pragma once

#include "runtime/settings.h"
#include "schema/asset_view.h"
#include "schema/result.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace keratin {

enum class PassId {
    skin,          // root transforms from bones or triangles
    grid_scatter,  // points into the grid
    grid_resolve,  // sums to mean displacement and density gradient
    grid_gather,   // grid back to the points
    integrate,     // Verlet with varying step
    local_shape,   // bending towards the groomed shape
    stretch,       // segment lengths, and the factor of the global length
    collide,       // colliders with friction
    final_length,  // exact lengths, outside of the colliders
    carry,         // render strands carried rigidly by their roots (attach: all)
    interpolate    // render strands from three guides
};
inline constexpr std::size_t kPassCount = 11;
std::string_view name_of(PassId pass);

enum class BufferId {
    position,         // guides, end of the step
    previous,         // guides, one small step earlier
    rest_edge,        // guides, unloaded edges in the root's frame
    filling_rest,     // guides, filling of the grid in the groom at rest, and own share of it
    root,             // root transform of each guide, start and end of the step
    bone_pose,        // bones, start and end of the step
    mesh_position,    // stored mesh vertices, end of the step
    triangle_slot,    // source triangle of a root -> stored triangle
    grid_sum,         // fixed-point sums of each brick of voxels that is in use
    grid_field,       // mean displacement and density gradient of these voxels
    grid_brick,       // which bricks are in use
    collider,         // collider shapes and their motion
    strand_root,      // root transform of each render strand
    guide_line,       // displacement of the guides' points, laid out for interpolation
    strand_position,  // output
    strand_tangent,   // output
    strand_previous,  // output of the step before
    quad_state,       // per 64 guides: bounds, sleep, health
    scratch           // per thread
};
inline constexpr std::size_t kBufferCount = 19;
std::string_view name_of(BufferId buffer);

struct PlannedPass {
    PassId id;
    std::vector<BufferId> buffers;
};
struct PlannedBuffer {
    BufferId id;
    std::uint64_t bytes = 0;
};
// A pass or buffer that the scene does not need.
struct LeftOut {
    std::string name;
    std::string reason;  // "no friction and no volume in any group"
};

struct SolverPlan {
    std::vector<PlannedPass> passes;     // in the order in which they run
    std::vector<PlannedBuffer> buffers;  // the union over the passes
    std::vector<LeftOut> left_out;
    std::uint32_t iterations = 0;  // constraint iterations per 1/60 s (largest of the groups)

    bool has(PassId pass) const;
    bool has(BufferId buffer) const;
    std::uint64_t bytes(BufferId buffer) const;  // 0 when left out
    std::uint64_t total_bytes() const;
};

// Errors: input when a setting is not finite or out of its range, with its name
// ("colliders[2].radius"); unsupported when guides have fewer than 3 or more than 32 points
// (attach: all excepted) or the instruction set is missing on this processor.
Result<SolverPlan> make_plan(const AssetInfo& info, const AssetFields& fields,
                             const Settings& settings);
inline Result<SolverPlan> make_plan(const AssetView& asset, const Settings& settings) {
    return make_plan(asset.info(), asset.fields(), settings);
}

// The plan as text for people: each pass with its buffers and their sizes, then what was left out
// and why. Lines end in '\n'.
std::string explain(const SolverPlan& plan);

}  // namespace keratin
