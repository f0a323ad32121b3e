// Meshes: OBJ through our own reader, FBX, glTF and others through Assimp.
#pragma once

#include "bake/raw_groom.h"
#include "schema/result.h"

#include <string>

namespace keratin {

// A triangulated mesh with named parts, in the file's order. Positions are finite.
// OBJ is not left to Assimp, which numbers vertices by their values, so that two expressions of
// one face get different triangles, and which takes nan for a position.
// Other formats: nodes are placed by their transforms, skinned parts by the pose that the file
// shows; a part is named after its node. Each keeps at most four bones a vertex, the heaviest.
// Errors: io: missing or unreadable. input: damaged, no triangles, a position that is not finite.
Result<RawMesh> read_mesh(const std::string& path);

}  // namespace keratin
