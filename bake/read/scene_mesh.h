// Meshes in the formats that Assimp reads.
#pragma once

#include "bake/raw_groom.h"
#include "schema/result.h"

#include <string>

namespace keratin {

// As read_mesh; every file that Assimp opens besides `path` is named in `dependencies`.
Result<RawMesh> read_scene_mesh(const std::string& path);

}  // namespace keratin
