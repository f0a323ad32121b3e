// Runs the `strand` solver (METHODS 1) on one instance of an asset. create() is the only place that
// allocates; step() and everything else works in what it laid out.
//
//     auto simulation = Simulation::create(asset, settings);
//     for (;;) {
//         simulation->set_motion(head);          // where the asset is at the end of the step
//         simulation->step(1.0 / 60);
//         draw(simulation->strands());
//     }
//
// Positions handed out count from origin() (by default the world's). The asset, or the memory
// behind its fields, must outlive the simulation; several simulations may share one asset. A
// Simulation is used by one thread at a time; different ones may run at the same time. No global
// state. A host may lend memory and threads and take messages (host.h).
#pragma once

#include "runtime/plan.h"
#include "runtime/settings.h"
#include "schema/asset_view.h"
#include "schema/result.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace keratin {

// Guides, tiled as schema/layout.h says. Valid until the simulation is destroyed; the content
// changes with each step. Empty when the plan has no guides (attach: all, or no interpolation
// needed).
struct GuideView {
    std::span<const float> position;  // [rows * 16 * 3] m, relative to the origin
    std::span<const float> previous;  // [rows * 16 * 3] m, previous_step before
    double previous_step = 0;         // s
};

// Render strands. positions of strand s: points first_point[s] .. first_point[s + 1], xyz
// interleaved. With Settings::previous a step swaps the buffers of position and previous: take the
// view anew after each.
struct StrandView {
    std::span<const std::uint32_t> first_point;  // [strands + 1]
    std::span<const float> position;             // [points * 3] m; empty with half output
    std::span<const std::uint16_t>
        position_half;                   // [points * 3] m as IEEE half, relative to half_center
    std::span<const float> tangent;      // [points * 3] unit; empty unless asked for
    // Where the same points were before the last step, from the present origin; as position is after a
    // reset, teleport, load, or for strands that a higher level of detail brings in. Empty unless
    // asked for.
    std::span<const float> previous;
    std::span<const std::uint16_t> previous_half;  // relative to half_center_previous
    std::array<float, 3> half_center_previous{};
    std::span<const float> radius;       // [strands] m at the root; empty: the group's
    std::span<const float> uv;           // [strands * 2]; empty without
    std::span<const std::uint32_t> id;   // [strands]
    std::array<float, 3> half_center{};  // m, relative to the origin
    std::uint32_t strand_count = 0;      // of this level of detail, 0 when none are interpolated; the
                                         // spans hold all
    float width_scale = 1;               // keeps the covered area when fewer are drawn
    std::array<float, 3> bounds_min{}, bounds_max{};  // m, relative to the origin; of the guides
                                                      // and what they carry
};

// Passes of the small steps share sweeps over the strands; a sweep's time counts for the pass that
// asks for most of it: local_shape from integrate to its forces, stretch from local_shape's moves to
// the elimination, final_length from stretch's moves over collide to the end.
struct PassTime {
    PassId pass;
    double seconds = 0;  // CPU time summed over threads, all steps since create or reset_stats
};

struct HealthCounters {
    std::uint64_t steps = 0;
    std::uint64_t small_steps = 0;    // over all steps
    std::uint64_t strands_reset = 0;  // not finite: put back to the rest pose
    std::uint64_t strands_teleported = 0;
    std::uint64_t roots_refused =
        0;  // root transforms that were not finite: the last good one is kept
    std::uint32_t strands_asleep = 0;  // now
};

struct Stats {
    std::vector<PassTime> passes;  // those of the plan
    double step_seconds = 0;       // wall time in step(), all steps
    HealthCounters health;
    std::uint64_t bytes = 0;  // allocated
};

enum class Velocity { keep, zero };

class Simulation {
  public:
    // Errors: those of make_plan.
    static Result<Simulation> create(const AssetInfo& info, const AssetFields& fields,
                                     const Settings& settings);
    static Result<Simulation> create(const AssetView& asset, const Settings& settings) {
        return create(asset.info(), asset.fields(), settings);
    }
    Simulation(Simulation&&) noexcept;
    Simulation& operator=(Simulation&&) noexcept;
    ~Simulation();

    const SolverPlan& plan() const;
    const Settings& settings() const;
    const AssetInfo& info() const;
    const AssetFields& fields() const;

    // Inputs, for the end of the next step. Between steps the solver moves roots and colliders
    // evenly from where they were to where they shall be. Errors (input): not finite, wrong count.
    //
    // The whole asset: rest space to world. Multiplies bones and mesh vertices too.
    Result<void> set_motion(const RigidTransform& motion);
    // Bones, rest pose to present, in the order of AssetInfo::bones; in asset space.
    Result<void> set_bones(std::span<const RigidTransform> bones);
    // Vertices of the *source* mesh, in asset space: [mesh_vertex_count * 3] m.
    Result<void> set_mesh(std::span<const float> positions);
    // Collider `index` of Settings::colliders: its own space to world.
    Result<void> set_collider(std::size_t index, const RigidTransform& motion);
    Result<void> set_gravity(const std::array<float, 3>& gravity);
    Result<void> set_wind(const Wind& wind);
    // Share of the render strands, 0..Settings::lod.
    Result<void> set_lod(float share);

    // Advances by h seconds (1e-5 .. 0.25; longer steps are refused: input).
    Result<void> step(double h);

    // Puts every strand to its rest pose on the present inputs, at rest.
    void reset();
    // Jumps to the inputs set since the last step: every strand is carried rigidly with its root
    // and keeps its shape; velocities are turned along or dropped. Time does not pass.
    void teleport(Velocity velocity);
    // Shows what another solver does with the guides: they stand where it has them, at rest, on the
    // inputs set since the last step, and the render strands follow. Time does not pass.
    //   position  [rows * 16 * 3] m, as guides(); rows below a tip and empty lanes are not read
    // Errors (input): another count.
    Result<void> show(std::span<const float> position);

    // The point that positions count from, in the world. Moving it by a whole number of metres that
    // float can hold changes no strand by more than rounding.
    const std::array<double, 3>& origin() const;
    void set_origin(const std::array<double, 3>& origin);

    double time() const;  // s since create or reset

    GuideView guides() const;
    StrandView strands() const;
    // Rest space to the present, relative to the origin, of the guide with this lane index
    // (tile * 16 + lane).
    RigidTransform guide_root(std::size_t lane_index) const;

    const HealthCounters& health() const;
    Stats stats() const;
    void reset_stats();

    // Over the bits of all guide positions and render positions in use, empty lanes left out.
    std::uint64_t position_hash() const;

    // The whole changing state. A simulation of the same asset and settings that loads it goes on
    // bit for bit as this one would. Errors of load (input): not a state, or of another asset or
    // settings.
    std::vector<std::byte> save() const;
    Result<void> load(std::span<const std::byte> state);

    struct State;  // the insides, runtime/state.h

  private:
    explicit Simulation(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace keratin
