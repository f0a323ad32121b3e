// Points of the groom that lie inside the mesh at rest: counted always, moved out on request.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/roots.h"
#include "schema/read/recipe.h"

namespace keratin {

// Depth in m from which a point counts as inside: that of the run's own check.
inline constexpr double kInsideDepth = 0.001;

// Counts the points deeper than kInsideDepth in the parts their strand grows on, and with
// recipe.push_out moves every point that lies inside, roots excepted, to the nearest place of the
// surface, or outside of it by the margin that the distance grid keeps. Moved strands keep their number of points; their lengths are measured anew by
// stage/rest. Nothing happens without a mesh.
BakeReport::Inside find_inside(const GrowthSurfaces& surfaces, const Recipe& recipe, Groom& groom,
                               Findings& findings);

}  // namespace keratin
