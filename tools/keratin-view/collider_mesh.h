// Colliders as triangles, to be laid over a picture.
#pragma once

#include "schema/cache.h"
#include "tools/keratin-view/mesh_file.h"

namespace keratin::view {

// Spheres and capsules in facets of about 10 degrees; a plane as a square of side `reach` (m)
// around its point.
BodyMesh collider_mesh(const CacheCollider& collider, float reach);

}  // namespace keratin::view
