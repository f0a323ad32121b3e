// Which end of a strand is its root.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/mesh_tree.h"
#include "schema/read/recipe.h"

#include <span>
#include <vector>

namespace keratin {

struct RootEnds {
    std::string end;             // "first", "last" or "mixed"
    std::string from;            // "recipe", "mesh" or "default"
    std::uint64_t reversed = 0;  // strands turned round
};

// Turns strands round so that the root comes first.
//   trees  [curve files]  the mesh parts each file grows on; null without a mesh
// A file whose recipe says `auto` is judged as a whole: strands with one end clearly nearer to the
// mesh vote for that end (some 2000 of a file are asked), and the end with at least four of five
// votes is the root of all. So a tip that lies on the skin does not turn its strand round. Without
// such a majority the file runs both ways and each strand is judged by itself. Without a mesh the
// first point is the root. Returns one entry a curve file.
std::vector<RootEnds> orient_strands(const Recipe& recipe, std::span<const MeshTree* const> trees,
                                     Groom& groom, Findings& findings);

}  // namespace keratin
