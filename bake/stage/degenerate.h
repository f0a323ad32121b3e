// Strands that are none.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "schema/read/recipe.h"
#include "schema/result.h"

namespace keratin {

enum class Strictness { lenient, strict };

// A strand shorter than this share of the median of its file is left out: real grooms hold
// collapsed strands of a thousandth and less (67 of 48 113 in the TressFX bear).
inline constexpr double kDegenerateShare = 1e-3;

// Leaves out strands with fewer than two distinct points or shorter than kDegenerateShare of their
// file's median, and reports their numbers.
// Errors (input): all strands of a file are degenerate; any is, when strict.
Result<Groom> drop_degenerate(Groom groom, const Recipe& recipe, Strictness strictness,
                              Findings& findings);

}  // namespace keratin
