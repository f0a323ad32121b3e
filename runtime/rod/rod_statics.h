// A clamped rod at rest under its weight, the other way round: the strain under which a given shape
// bears it (METHODS 1.4, sag-free start, for the energies of METHODS 2.2). For a fixed centre line
// the weight beyond an edge says which force the edge and the joint at its start pass on:
//
//     dE/de_j = g sum_{i > j} m_i,    dE/dtheta_j = 0,    j = edges - 1 .. 0
//
// from the tip inwards, one edge with its joint at a time. Along the edge that is its stretch;
// across it and about it three equations for the joint's bend and twist, which are linear but for
// the joint's stiffness correction and the half turns of its rest frames: a few Newton iterations.
#pragma once

#include "runtime/rod/rod_strand.h"

#include <span>
#include <vector>

namespace keratin {

// The largest strains that bear_weight gives: no hair stands more. A joint that would need more
// passes on what it can.
inline constexpr double kMostBorneStretch = 0.5, kMostBorneBend = 8, kMostBorneTwist = 30;

struct WeightBorne {
    // [points - 1], for RodStrand::rest_strain; rounded to float, as an asset stores it.
    std::vector<RodStrain> strain;
    // The shape is in equilibrium with this strain and comes back when it is nudged. If not, the
    // strain is one with which the strand settles near to the shape: nearest of those that hold a
    // pose on the way from the shape to where it sags to.
    bool held = false;
    // Largest force on a point that nothing balances (or moment on an edge over the length), over
    // the weight of the free points.
    double residual = 0;
    double settles = 0;  // m, largest distance of a point from the shape once at rest; 0 if held
};

// The strain that bears the weight of `strand` in the shape of its points. The stiffness scales of
// RodSettings are 1.
//   strand   valid (RodSimulation::create), root clamped, tip free; velocities and rest values are
//            not looked at
//   gravity  m/s^2
// Not taken into account: what bears hair besides its own stiffness (contact).
WeightBorne bear_weight(const RodStrand& strand, const Double3& gravity);

}  // namespace keratin
