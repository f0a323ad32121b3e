// One reader a format, each from bytes in memory. `file` names them in errors and in the result.
// Every reader checks sizes before it allocates and never needs more than a fixed multiple of the
// bytes it is given. Layouts: FORMATS §1.2 and the comments in each source.
#pragma once

#include "bake/raw_groom.h"
#include "schema/result.h"

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace keratin {

// TressFX strands, version 3 and 4. Version 4 marks points that are carried (w = 0): fixed_points.
Result<RawGroom> read_tfx(std::string_view bytes, const std::string& file);

// Cem Yuksel's .hair. Widths come from its array alone: the default that each file must state says
// nothing about its unit.
Result<RawGroom> read_hair(std::string_view bytes, const std::string& file);

// USC-HairSalon .data and its variants, told apart by the exact length of the file.
Result<RawGroom> read_usc_data(std::string_view bytes, const std::string& file);

// Finds the bytes of a buffer by the URI that a glTF file gives for it.
using OpenBuffer = std::function<Result<std::string>(const std::string& uri)>;

// glTF 2, as JSON or binary: lines (edges are put together to chains), line strips; placed by
// their nodes, which are the groups. `_WIDTH` or `_RADIUS` a point, `TEXCOORD_0` at the root.
// Not read: sparse accessors, compressed buffers.
Result<RawGroom> read_gltf_curves(std::string_view bytes, const std::string& file,
                                  const OpenBuffer& open_buffer);

// What in a glTF file would bring Assimp 5.2 down (a skin without inverse bind matrices, which glTF
// allows), or nothing.
std::optional<Error> find_gltf_mesh_fault(std::string_view bytes, const std::string& file);

// Curves of an Alembic file (Ogawa; one with HDF5 inside is refused by name), in the order of the
// file, placed by their parents' transforms, the sample nearest to `time` (s).
//   Linear curves are polylines. Cubic ones are NURBS: B-splines with the file's knots or evenly
//   spaced ones, Bezier pieces, Catmull-Rom (from the second point to the last but one). Curves of
//   variable order need orders and knots. Weights are taken as they are: points are not divided.
//   `width`, `uv` and Unreal's groom attributes (groom_width, _root_uv, _id, _group_id,
//   _group_name, _guide, _closest_guides, _guide_weights) become channels; the groups are the group
//   ids or names, else the objects.
// Not read: instances, Hermite and power bases.
Result<RawGroom> read_alembic(std::string_view bytes, const std::string& file, double time);

// TressFX bindings of strands to triangles.
Result<RawBinding> read_tfxskin(std::string_view bytes, const std::string& file);

// TressFX bones of a groom.
Result<RawSkin> read_tfxbone(std::string_view bytes, const std::string& file);

// Curves of an OBJ file: free-form ones (`cstype [rat] bspline` or `bezier`, with `deg`, `curv`,
// `parm u`, `end`) and polylines (`l`).
//   The fourth number of a `v` is a weight in rational curves only. A curve is cut to its valid
//   range, which unclamped curves may declare larger (Blender). Points run as `curv` lists them.
//   An `l` of three or more vertices is a polyline. Those of two are edges: their chains are put
//   together whatever their order and direction, starting at the end with the lower vertex number;
//   a vertex with more than two edges and a closed loop have no such chain and are left out.
//   `g` names a curve, `o` its group. Meshes and surfaces in the file are passed over.
Result<RawGroom> read_obj_curves(std::string_view text, const std::string& file);

// A polygon mesh in OBJ. Numbering and triangles follow the file's indices alone, never its
// positions, so that expressions of one face get the same triangles: a vertex is a pair
// (position, texture coordinate) in order of first use; a polygon is cut into a fan from its first
// corner. Parts are named by `o` or `g`, whichever came last; by `usemtl` in a file without them.
// The file's material libraries are named in `dependencies` as written.
Result<RawMesh> read_obj_mesh(std::string_view text, const std::string& file);

}  // namespace keratin
