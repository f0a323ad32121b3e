#include "tools/keratin-view/mesh_file.h"

#ifdef KERATIN_WITH_BAKE
#include "bake/read/read_mesh.h"
#endif

namespace keratin::view {

#ifdef KERATIN_WITH_BAKE
Result<BodyMesh> read_body(const std::string& path, double scale) {
    const auto raw = read_mesh(path);
    if (!raw) return raw.error();
    BodyMesh body;
    body.position.reserve(3 * raw->position.size());
    for (const Vec3& p : raw->position)
        for (int c = 0; c < 3; ++c) body.position.push_back(float(scale * p[c]));
    body.triangle.reserve(3 * raw->triangle.size());
    for (const auto& t : raw->triangle)
        body.triangle.insert(body.triangle.end(), t.begin(), t.end());
    return body;
}
#else
Result<BodyMesh> read_body(const std::string& path, double) {
    return Error{
        ErrorCode::unsupported, path,
        "this build reads no meshes (KERATIN_WITH_BAKE is off); store the mesh in the asset"};
}
#endif

}  // namespace keratin::view
