// What follows from a group's material.
#pragma once

#include "schema/asset.h"

namespace keratin {

// E I over the mass of a metre (m^4/s^2), of an ellipse and the mean of both directions: E (r1^2 +
// r2^2) / (8 density).
inline double bending_per_mass(const Material& m) {
    return double(m.youngs_modulus) *
           (double(m.radius) * m.radius + double(m.radius2) * m.radius2) / (8 * double(m.density));
}

}  // namespace keratin
