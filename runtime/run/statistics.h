// What `--stats` writes: measured with tools/measure from the states at the ends of frames, apart
// from the solver; only what the solver alone can know comes from it. The document follows
// schema/stats.schema.json.
#pragma once

#include "runtime/run/motion.h"
#include "runtime/run/solver_run.h"
#include "schema/asset_view.h"
#include "tools/measure/crowd.h"
#include "tools/measure/penetration.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <vector>

namespace keratin {

class Statistics {
  public:
    // `run` and `scene` outlive this object. Opens the scene's assets again, for their meshes.
    // Errors: input, io.
    static Result<std::unique_ptr<Statistics>> create(const Scene& scene, const SolverRun& run);

    // Measures the state at the end of a frame (or the initial one).
    void add_frame(double time, const RunState& state);

    // The document, from what was measured so far.
    nlohmann::ordered_json document(const SolverRun& run, const Schedule& schedule,
                                    int threads) const;

  private:
    // The mesh of an asset and the guides that grow near it.
    struct Body {
        std::unique_ptr<AssetView> asset;
        std::unique_ptr<measure::MeshDistance> mesh;
        std::unique_ptr<measure::PenetrationTracker> tracker;
        std::vector<std::array<std::uint32_t, 3>> triangles;
        std::vector<measure::Point> rest;  // of its simulated points
        std::vector<double> rest_depth;
        std::size_t first_point = 0;
    };
    // A mesh of the scene that strands collide with, in its own space.
    struct ColliderMesh {
        std::unique_ptr<measure::MeshDistance> mesh;
        const SceneCollider* collider = nullptr;
    };
    double mesh_penetration(const RunState& state);
    double collider_penetration(double time, const RunState& state) const;
    double strand_penetration(const RunState& state) const;
    // How far a strand's centre line is to keep away from a collider, m.
    double distance_kept(const SceneCollider& collider, std::size_t strand) const;
    double interpolation_distance(const RunState& state) const;

    const Scene* scene_ = nullptr;
    const RunLayout* layout_ = nullptr;
    std::vector<Body> bodies_;
    std::vector<ColliderMesh> collider_meshes_;
    std::vector<std::array<std::uint32_t, 2>> neighbours_;
    double spacing_ = 0;  // m, of the density grid
    bool has_mesh_ = false;

    bool finite_ = true;
    double max_stretch_ = 0, max_mesh_ = 0, max_collider_ = 0, max_strand_ = 0, max_tip_lag_ = 0;
    nlohmann::ordered_json energy_ = nlohmann::ordered_json::array();
    nlohmann::ordered_json series_ = nlohmann::ordered_json::object();
};

// [[[x, y, z], ...] per strand]
nlohmann::ordered_json points_by_strand(std::span<const std::uint32_t> first_point,
                                        std::span<const measure::Point> points);

}  // namespace keratin
