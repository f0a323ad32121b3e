// Points at equal steps of arc length.
#pragma once

#include "bake/report.h"
#include "bake/stage/groom.h"
#include "schema/read/recipe.h"

#include <span>

namespace keratin {

// Points a strand gets when the recipe says neither points_per_strand nor max_error.
inline constexpr std::uint32_t kDefaultPoints = 16;

// Gives every strand `points_per_strand` points at equal steps of its arc length, the ends exactly
// where they were. With `max_error` instead each strand gets the fewest points (at least 3, which
// every solver takes, at most 1024) whose polyline stays within that distance of the strand;
// strands that would need more are reported. Strands marked `even` that already have the right
// number of points, and polylines whose points stand evenly to within 1e-6 of their length, are
// left alone.
Groom resample(Groom groom, const Recipe& recipe, Findings& findings);

// The points of one strand at `count` equal steps of arc length; out.size() is the count (>= 2).
void resample_polyline(std::span<const Vec3> points, std::span<Vec3> out);

// Largest distance of the polyline's vertices from its resampled version, each compared with the
// two segments about its own arc length.
double resampling_error(std::span<const Vec3> points, std::span<const Vec3> resampled);

}  // namespace keratin
