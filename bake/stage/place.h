// Units and axes: from the files' own to metres with y up.
#pragma once

#include "bake/raw_groom.h"
#include "bake/report.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

#include <vector>

namespace keratin {

// A point of a file with the given axes, in right-handed y-up axes. Left-handed axes are mirrored
// first: y is negated where z is up (Unreal), z elsewhere (Unity, Direct3D).
Vec3 to_y_up(const Vec3& file, UpAxis up, Handedness hand);

// Metres per unit of curve file `source`: the recipe's scale times the file's own. A file that
// states its unit (IGES) is taken at its word when the recipe gives no scale.
double metres_per_unit(const RawGroom& groom, const Recipe& recipe, std::size_t source);

// Moves the control points and radii of every file into metres, y up.
// Errors (input): a coordinate that is not finite, or too large for the asset's floats; the place
// names file, strand and point.
Result<void> place_curves(const Recipe& recipe, std::vector<RawGroom>& grooms, Findings& findings);

// The same for the mesh. Of left-handed files the triangles are turned round, so that they face out
// as before; their hash is another then, and posed meshes of a scene (mesh_frames), which are read as
// right-handed, are refused.
Result<void> place_mesh(const Recipe& recipe, RawMesh& mesh);

}  // namespace keratin
