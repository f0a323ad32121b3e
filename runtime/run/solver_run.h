// One run of a scene, whichever solver computes it, as the program's outputs and statistics see it.
#pragma once

#include "schema/cache.h"
#include "schema/read/scene.h"
#include "schema/result.h"
#include "tools/measure/point.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// What does not change during a run. "Simulated strands" are the guides of assets and the explicit
// strands of the scene; "render strands" are what is drawn.
struct RunLayout {
    CacheHead head;                          // strands, assets; outputs copy it
    std::vector<measure::Point> rest;        // [simulated points] m
    std::vector<measure::Point> unloaded;    // [simulated points] m, shape without elastic energy,
                                             // first segment as at rest; empty: rest
    std::vector<double> mass;                // [simulated points] kg
    std::vector<double> stretch_stiffness;   // [simulated strands] N, EA
    std::vector<double> bend_stiffness;      // [simulated strands] N m^2, EI
    std::vector<std::uint32_t> held_points;  // [simulated strands] points at the root not simulated
    std::vector<double> thickness;           // [simulated strands] m, radius that contact keeps
                                             // free; empty: strands are lines
    std::vector<float> uv;                   // [render strands * 2] or empty
    std::vector<std::uint32_t> id;           // [render strands]
    std::uint64_t degrees_of_freedom = 0;
};

// The state at the end of a step. World, m, s.
struct RunState {
    std::vector<measure::Point> position, velocity;  // [simulated points]
    std::vector<measure::Point> rigid;               // [simulated points] rest carried by the root
    std::vector<measure::Rigid> root;                // [simulated strands] rest to the present
    std::vector<float> strand_position;              // [render points * 3]
    std::vector<CacheBody> bodies;                   // [assets]
    std::vector<CacheCollider> colliders;            // of the scene and of the assets
    std::size_t scene_colliders = 0;                 // of these, the first so many
    std::optional<double> elastic;                   // J, when the solver knows it best
};

// How the command line changes a run.
struct RunOptions {
    std::string tool_version;
    int threads = 0;           // 0: one a processor
    bool convergence = false;  // keep what each iteration of the last step did
};

class SolverRun {
  public:
    virtual ~SolverRun() = default;
    virtual const RunLayout& layout() const = 0;
    // The plan for people, and as JSON.
    virtual std::string explain() const = 0;
    virtual void plan(nlohmann::ordered_json& out) const = 0;

    // Advances from t0 to t1 (s) with the inputs of t1.
    virtual Result<void> step(double t0, double t1) = 0;
    virtual void look(RunState& out) const = 0;
    // Adds or replaces fields of the statistics that the solver alone knows.
    virtual void statistics(nlohmann::ordered_json& out) const = 0;
    virtual std::string hash() const = 0;

    virtual Result<std::vector<std::byte>> save() const = 0;
    virtual Result<void> load(std::span<const std::byte> state, double time) = 0;
};

// The runs of the solvers in this build. Errors: input, io, unsupported.
Result<std::unique_ptr<SolverRun>> make_strand_run(const Scene& scene, const RunOptions& options);
#ifdef KERATIN_WITH_ROD
Result<std::unique_ptr<SolverRun>> make_rod_run(const Scene& scene, const RunOptions& options);
#endif

}  // namespace keratin
