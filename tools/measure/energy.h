// Energies of strands as masses on segments that stretch and bend (METHODS 1 and 2.2), J.
#pragma once

#include "tools/measure/point.h"

#include <vector>

namespace keratin::measure {

// Mass of each point (kg): half of the segments beside it, line_density in kg/m.
std::vector<double> lumped_masses(const Strands& rest, std::span<const double> line_density);

double kinetic_energy(std::span<const double> mass, std::span<const Point> velocity);

// -sum m g.x: zero at the origin, whatever direction gravity has.
double potential_energy(std::span<const double> mass, std::span<const Point> position,
                        Point gravity);

// Stretch energy, sum of 1/2 EA (|e| / |e_rest| - 1)^2 |e_rest|.
//   stiffness [strands] N, EA
double stretch_energy(const Strands& strands, const Strands& rest,
                      std::span<const double> stiffness);

// Bending energy of the joints between segments, 1/2 |C|^2 / alpha with C = e - Q d the distance of
// a segment's end from where its parent's frame wants it and alpha = l |e_rest|^2 / EI
// (METHODS 1.4, local shape). The frames start as the root's and are carried along by minimal
// rotations.
//   root [strands]       the rest pose to the present at the root
//   stiffness [strands]  N m^2, EI
double bend_energy(const Strands& strands, const Strands& rest, std::span<const Rigid> root,
                   std::span<const double> stiffness);

}  // namespace keratin::measure
