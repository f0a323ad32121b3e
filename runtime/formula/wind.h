// The wind's force on a strand. The turbulent part is a sum of waves that travel with the mean
// wind.
#ifndef KERATIN_RUNTIME_FORMULA_WIND_H
#define KERATIN_RUNTIME_FORMULA_WIND_H

#include "schema/formula/vec3.h"
#ifdef __cplusplus
namespace keratin {
#endif
#include "schema/formula/dual.h"

// A smooth wave of period 1 in k.x + phase, between -1 and 1: s (3 - 4 s^2) of the triangle wave s
// in
// [-1/2, 1/2] times 1, which has the zeros, peaks and slopes at zero crossings of a sine within 5
// %.
KERATIN_FORMULA Real wave_at(Real3 x, Real3 k, Real phase) {
    Real turns = dot(x, k) + phase;
    Real fraction = turns - round_even(turns);
    Real triangle = select(abs(fraction) < Real(0.25), fraction + fraction,
                           select(fraction < Real(0), Real(-1) - (fraction + fraction),
                                  Real(1) - (fraction + fraction)));
    return triangle * (Real(3) - Real(4) * triangle * triangle);
}

// Drag towards the wind at the rate c (1/s), implicit in the step so that any rate is stable:
// c (wind - v) / (1 + c h).
KERATIN_FORMULA Real3 wind_acceleration(Real3 wind, Real3 velocity, Real rate, Real inverse_step) {
    return (wind - velocity) * (rate * inverse_step / (inverse_step + rate));
}

#include "schema/formula/dual_end.h"
#ifdef __cplusplus
}  // namespace keratin
#endif
#endif
