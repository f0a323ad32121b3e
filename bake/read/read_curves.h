// Curves of any format that the bake knows, by the name's ending and the content.
//   .tfx          TressFX 3 and 4
//   .obj          free-form curves (cstype bspline and bezier, rational or not), polylines, and
//                 loose edges that make chains
//   .hair         Cem Yuksel's
//   .data         USC-HairSalon
//   .gltf .glb    lines and line strips
//   .abc          Alembic curves
//   .igs .iges .stp .step   NURBS curves, in builds with KERATIN_WITH_OCCT
#pragma once

#include "bake/raw_groom.h"
#include "schema/result.h"

#include <string>

namespace keratin {

// Errors: io: the file is missing or unreadable. input: the file is damaged, or holds not one
// usable curve. unsupported: the format is not known or not in this build.
// Of a file that moves, the sample nearest to `time` (s) is taken; only Alembic can move.
// Curves that are unusable in a file that is otherwise sound are listed in RawGroom::problems.
Result<RawGroom> read_curves(const std::string& path, double time = 0);

// A .tfxbone file: bones by name, four bones and weights a strand.
Result<RawSkin> read_skin(const std::string& path);

// A .tfxskin file: the triangle and barycentric coordinates of each strand's root.
Result<RawBinding> read_binding(const std::string& path);

}  // namespace keratin
