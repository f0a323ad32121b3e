// An asset of a scene and what moves it: what the runs of all solvers that take assets do alike.
#pragma once

#include "runtime/run/mesh_frames.h"
#include "runtime/run/motion.h"
#include "runtime/run/solver_run.h"
#include "runtime/simulation.h"
#include "schema/asset_view.h"

#include <cstdint>
#include <vector>

namespace keratin {

struct AssetBody {
    const SceneAsset* scene = nullptr;  // outlives the body
    AssetView asset;
    std::vector<const Motion*> bones;  // [bones of the asset], null: at rest
    MeshFrames mesh;
    std::vector<std::uint32_t> lanes;  // of the simulated guides, ascending; set by add_guides
    std::uint32_t strand_count = 0;    // render strands in use; set by add_render_strands
    std::uint32_t first_guide = 0, first_guide_point = 0;  // in the run's layout

    std::uint32_t guide_points(std::size_t g) const {
        return asset.fields().guide_point_count[lanes[g]];
    }
};

// Opens the asset and what moves it. Errors: those of AssetView::open and read_mesh_frames; input
// when a bone or a mesh is moved that the asset has not.
Result<AssetBody> open_body(const SceneAsset& scene);

// Point p of the guide in a lane, of a field or buffer of rows.
measure::Point guide_point(std::span<const float> rows, const AssetFields& fields,
                           std::uint32_t lane, std::uint32_t p);

// A layout without strands yet, of a run of the scene by this solver.
RunLayout empty_layout(const Scene& scene, const RunOptions& options, const char* solver);
// Appends all guides of the body to the layout: rest points, masses, stiffnesses, lanes.
//   held  points at the root that are not simulated
void add_guides(AssetBody& body, std::uint32_t held, RunLayout& layout);
// The same for a body none of whose guides is simulated: nothing but its place.
void skip_guides(AssetBody& body, const RunLayout& layout);
// Appends the first `count` render strands of the body, and its entry in the head. After
// add_guides.
void add_render_strands(AssetBody& body, std::uint32_t count, RunLayout& layout);

// Bones at a time, rest to present, in asset space; empty when the asset has none.
std::vector<RigidTransform> bones_at(const AssetBody& body, double time);

// Gives a simulation of the asset its motion, bones and mesh at a time. Errors name the asset.
Result<void> set_body_inputs(const AssetBody& body, double time, Simulation& simulation);

// Rest to present of the body's guides' roots at a time, world, in the order of `lanes`. The same
// transforms as the strand solver's, in double.
void guide_roots(const AssetBody& body, double time, std::vector<RigidTransform>& out);

// Where the body is at a time, for the cache.
CacheBody cache_body(const AssetBody& body, double time);
CacheTransform to_cache(const RigidTransform& m);
// The asset's fitted shapes at a time.
std::vector<CacheCollider> cache_asset_colliders(const AssetBody& body, double time);

}  // namespace keratin
