// One strand of the strand solver at rest under gravity: its energy, the moments that are left
// over, where it settles, and the rest shape with which it settles where it is (METHODS 1.4,
// Beyond).
#pragma once

#include "schema/formula/vec3.h"

#include <cstddef>
#include <span>
#include <vector>

namespace keratin {

// Segment m runs from point m - 1 to point m, m = 1 .. segments; entry 0 of each list is not used.
// Joint m sits between the segments m and m + 1. Segment 1 is carried by the root. Everything is
// per mass of a metre of strand: stiffness in m^3/s^2, energy in m^3/s^2.
//
//   E(t) = sum_m S_m (1 - t_{m+1}.g_m) - sum_m b_m l_m a.t_m,   g_m = P(r_m, t_m) r_{m+1}
//
// t directions now, r directions unloaded (r_1 = t_1), S_m = k_m l_{m+1}^2 (schema/bend.h), b_m the
// mass beyond the middle of segment m, a the acceleration of gravity.
struct StrandStatics {
    using V = Vec3<double>;
    std::vector<double> length, beyond, stiffness;
    std::vector<V> unloaded;
    V gravity;

    std::size_t segments() const { return length.size() - 1; }
};

// The strand whose unloaded shape is its present one.
//   points   [segments + 1]  m, root first, no two neighbours equal
//   bending  E I over the mass per length, m^4/s^2
StrandStatics strand_statics(std::span<const Vec3<double>> points, double bending,
                             const Vec3<double>& gravity);

// Directions of the segments between the points, 1 .. segments; entry 0 is the first one's.
std::vector<Vec3<double>> directions(std::span<const Vec3<double>> points);

double energy(const StrandStatics& s, std::span<const Vec3<double>> t);

// dE/dt of each segment, across it, 2 .. segments; the others are 0.
std::vector<Vec3<double>> gradient(const StrandStatics& s, std::span<const Vec3<double>> t);

// The largest force across a segment that nothing balances, over the weight of the free segments: 1
// when nothing of a level strand is carried, 0 in equilibrium.
double residual(const StrandStatics& s, std::span<const Vec3<double>> t);

// Whether a strand in equilibrium at t comes back when it is nudged: the Hessian of the energy is
// positive definite, and the softest direction is stiffer than `margin` times the strand's weight
// at its length.
bool stable(const StrandStatics& s, std::span<const Vec3<double>> t, double margin);

// The directions in which the strand comes to rest from t: the minimum of the energy downhill.
std::vector<Vec3<double>> settled(const StrandStatics& s, std::vector<Vec3<double>> t);

// Unloaded directions with which the moments carry the weight at t, from the tip inwards. A joint
// takes at most `most` (0..1) of the moment it could at a right angle; where that is too little the
// strand is not in equilibrium at t (residual).
void carry_weight(StrandStatics& s, std::span<const Vec3<double>> t, double most);

}  // namespace keratin
