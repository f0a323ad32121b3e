// What a scene and its assets are to the rod solver: rods, settings and colliders.
#pragma once

#include "runtime/contact/strand_contact.h"
#include "runtime/rod/rod_simulation.h"
#include "runtime/run/asset_body.h"
#include "runtime/run/solver_run.h"
#include "schema/result.h"
#include "tools/measure/point.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace keratin {

inline measure::Point to_point(const Double3& v) { return {v[0], v[1], v[2]}; }
inline Double3 to_double3(measure::Point p) { return {p.x, p.y, p.z}; }

// The rotation vector that turns by a and then reaches b; quaternions x y z w.
Double3 turn_between(const std::array<double, 4>& a, const std::array<double, 4>& b);

// A strand as the solver takes it, carried to where its motion begins.
RodStrand to_rod(const SceneStrand& in);
// A guide as a rod: clamped at its root point, along its first segment, with the root frame's
// director u as m_1 (METHODS 2.2, convention A). Its rest shape is the groom, less the strain under
// which that bears its weight where the asset stores one.
RodStrand to_rod(const AssetBody& body, std::uint32_t lane, const RigidTransform& root);

RodSettings to_settings(const Scene& scene, const RunOptions& options);
ContactSettings to_contact(const Scene& scene, const RunOptions& options);

// The scene's colliders. They refer to the scene, and to meshes of theirs, which are added to
// `meshes`. Errors: a mesh that cannot be read; unsupported: a distance grid.
Result<void> add_colliders(const Scene& scene, std::vector<std::unique_ptr<TriangleTree>>& meshes,
                           std::vector<ContactCollider>& out);
// The fitted shapes of an asset, carried by its bones. They refer to the body. Errors
// (unsupported): the asset has a distance grid.
Result<void> add_asset_colliders(const AssetBody& body, std::vector<ContactCollider>& out);

}  // namespace keratin
