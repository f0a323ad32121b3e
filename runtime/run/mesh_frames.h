// Deformed meshes that carry hair on a face: OBJ files of the mesh an asset was bound to, one a
// keyframe, with other vertex positions.
#pragma once

#include "schema/asset.h"
#include "schema/read/scene.h"
#include "schema/result.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace keratin {

// The triangles of an OBJ file in its own unit. Vertices are numbered by first use of a pair of
// position and texture coordinate, faces split into fans.
struct ObjTriangles {
    std::vector<std::array<double, 3>> position;
    std::vector<std::array<std::uint32_t, 3>> triangle;
};

// Errors: io; input with file and line.
Result<ObjTriangles> read_obj_triangles(const std::string& path);

struct MeshFrames {
    std::vector<double> time;                  // s, rising
    std::vector<std::vector<float>> position;  // [frames][mesh_vertex_count * 3] m, asset space

    bool empty() const { return time.empty(); }
    // Linear between frames, held outside; out has the size of one frame. Of float and double.
    template <class Real>
    void at(double time, std::vector<Real>& out) const;
};

// Reads the mesh frames of `asset`. Vertices are numbered as the bake numbers them.
// Errors: io; input when a file does not parse or its triangles are not those that the asset was
// bound to.
Result<MeshFrames> read_mesh_frames(const SceneAsset& asset, const AssetInfo& info);

}  // namespace keratin
