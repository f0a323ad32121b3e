// Spheres and capsules that fill the body and keep hair out of it.
#pragma once

#include "bake/report.h"
#include "bake/stage/bones.h"
#include "bake/stage/groom.h"
#include "bake/stage/roots.h"
#include "schema/asset.h"

#include <vector>

namespace keratin {

struct ColliderFit {
    std::vector<AssetCollider> colliders;  // most useful first
    BakeReport::Colliders measured;
};

// Fits spheres and capsules to the mesh where hair can reach it, places weighed by how many strands
// reach how near.
//   skin        triangles on which a ball of 8 mm (or 4 % of the body, whichever is less) can lie
//   from
//               outside; narrower holes, such as a mouth, count as filled
//   candidates  medial balls, the largest balls inside the skin that touch it at a sample of the
//               surface (shrinking ball, Ma, Bae and Choi 2012), and capsules between two of them,
//               each with the distance of its core from the skin plus a bulge as radius: so none
//               stands further out of the skin than the bulge, 2 mm or 1 % of the body, whichever
//               is less
//   choice      greedy cover: again and again the candidate that covers most of the weight not yet
//               covered, until the rest is negligible or 96 are used
// A sample is covered when it lies in a collider or less than a quarter of the bulge outside one.
// The report says how far the union's surface stands outside the mesh, and how far the mesh sticks
// out of it, mean and 95 % by weight.
// Deterministic.
ColliderFit fit_colliders(const RawMesh& mesh, const Groom& groom, const Carriers& carriers,
                          Findings& findings);

}  // namespace keratin
