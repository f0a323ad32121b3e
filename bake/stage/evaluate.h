// Curves to polylines, and all files into one groom.
#pragma once

#include "bake/raw_groom.h"
#include "bake/report.h"
#include "bake/stage/degenerate.h"
#include "bake/stage/groom.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

#include <span>

namespace keratin {

// Polylines stay as they are; a NURBS curve becomes `points_per_strand` points at equal arc length
// on the curve itself, or with `max_error` as many as that needs. Groups are numbered in the order
// in which they are met; ids count the curves of all files, left-out curves included, unless every
// file brings its own and they are unique.
//   grooms  [recipe.curves]  in metres (stage/place)
// Errors (input): a curve that the readers could make nothing of, when strict.
Result<Groom> evaluate_curves(std::span<const RawGroom> grooms, const Recipe& recipe,
                              Strictness strictness, Findings& findings);

}  // namespace keratin
