// Spheres inside the body that keep hair out of it.
#pragma once

#include "bake/report.h"
#include "bake/stage/bones.h"
#include "bake/stage/groom.h"
#include "bake/stage/roots.h"
#include "schema/asset.h"

#include <vector>

namespace keratin {

struct ColliderFit {
    std::vector<AssetCollider> colliders;  // largest share of the surface first
    BakeReport::Colliders measured;
};

// Fits spheres to the part of the mesh that hair can reach: places of the mesh nearer to some root
// than its strand is long.
//   candidates  centres of medial balls, the largest balls inside the mesh that touch it at a
//   sample
//               of the surface (shrinking ball, Ma, Bae and Choi 2012), each with the distance of
//               its centre from the mesh plus a bulge as radius: so no sphere stands further out of
//               the mesh than the bulge, 2 mm or 1 % of the body, whichever is less
//   choice      greedy cover: again and again the candidate that covers most of the samples not yet
//               covered, until the rest is negligible or 96 spheres are used
// A sample is covered when it lies in a sphere or less than a quarter of the bulge outside one.
// The report says how far the union's surface stands outside the mesh and how far the mesh sticks
// out of it.
// Deterministic; nothing is chosen when no part of the mesh encloses a volume.
ColliderFit fit_colliders(const RawMesh& mesh, const Groom& groom, const Carriers& carriers,
                          Findings& findings);

}  // namespace keratin
