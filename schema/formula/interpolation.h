// Values along a strand: the position of a fraction of the arc length between samples, and ramps
// from root to tip.
#ifndef KERATIN_SCHEMA_FORMULA_INTERPOLATION_H
#define KERATIN_SCHEMA_FORMULA_INTERPOLATION_H

#include "schema/formula/vec3.h"
#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// a at s = 0, b at s = 1.
KERATIN_FORMULA Real mix_values(Real a, Real b, Real s) { return a + (b - a) * s; }
KERATIN_FORMULA Real3 mix_points(Real3 a, Real3 b, Real s) { return a + (b - a) * s; }

// k' = 1 - (1 - k)^(60 h): the share k per 1/60 s as a share per step h (s) (METHODS 1.3). In C++
// only for scalars, once a step.
#ifdef __cplusplus
inline double gain_per_step(double gain_per_60th, double h) {
    return 1.0 - std::pow(1.0 - gain_per_60th, 60.0 * h);
}

// The value of a ramp (at least one value, at equal steps from root 0 to tip 1) at fraction s.
template <class Values>
inline double ramp_value(const Values& values, double s) {
    const std::size_t last = values.size() - 1;
    const double place = (s < 0 ? 0 : s > 1 ? 1 : s) * static_cast<double>(last);
    const std::size_t i = place >= static_cast<double>(last) ? (last == 0 ? 0 : last - 1)
                                                             : static_cast<std::size_t>(place);
    const std::size_t j = i < last ? i + 1 : last;
    return values[i] + (values[j] - values[i]) * (place - static_cast<double>(i));
}
#endif

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
