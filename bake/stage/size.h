// How large everything is, and whether that can be hair.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "bake/stage/roots.h"

namespace keratin {

// Fills the sizes and the strand lengths of the report, in m. Reports hair shorter than 1 mm or
// longer than 3 m and a body (the parts hair grows on) smaller than 1 cm or larger than 20 m in its
// largest extent: a wrong scale or up axis shows there first. `mesh` may be null.
void measure_sizes(const Groom& groom, const RawMesh* mesh, const GrowthSurfaces& surfaces,
                   BakeReport& report, Findings& findings);

}  // namespace keratin
