// The contact scenes of METHODS 2.10 and 2.11: bundles, cylinder, ground, single strands, hairball.
// For tests, reports and the bench.
#pragma once

#include "runtime/contact/strand_contact.h"
#include "runtime/rod/rod_simulation.h"
#include "tools/measure/solid.h"

#include <functional>
#include <string>
#include <vector>

namespace keratin::scenes {

// A scene of rods with contact, ready to be stepped.
struct ContactScene {
    std::string name;
    std::vector<RodStrand> strands;
    std::vector<ContactCollider> colliders;
    std::vector<measure::Solid> solids;  // the same at rest, for measuring; one a collider
    RodSettings rod;
    ContactSettings contact;
    double step = 1e-3;              // s
    double duration = 1;             // s
    std::size_t least_contacts = 0;  // what the scene has at least, at its most
    std::size_t held_edges = 0;      // of each strand that the solids are not measured against
    // Moves held ends to where they shall be at time t, at the end of the next step; may be empty.
    std::function<void(RodSimulation&, double t, double h)> drive;
};

// A bundle clamped at one end falls on a bundle clamped at both (4-2).
ContactScene bundle_on_bundle(std::uint32_t strands_each = 40);
// A bundle clamped at one end falls over a cylinder (4-3).
ContactScene bundle_on_cylinder(std::uint32_t strands = 60);
// A slanted free bundle falls on the ground and comes to rest (4-4).
ContactScene bundle_on_ground(std::uint32_t strands = 40);
// A strand clamped at one end falls across a strand clamped at both (4-8).
ContactScene strand_on_strand(double friction);
// A free strand on a pipe inclined by 20 degrees (4-9).
ContactScene strand_on_pipe(double friction);
// Two strands and one contact (4-11).
ContactScene two_strands();

struct HairballOptions {
    std::uint32_t strands = 1000, vertices = 40;
    bool as_published =
        true;  // two-point clamps and stretching softened by 100; else convention A, full
};
// METHODS 2.11; at rest until 0.5 s, one turn about y until 4 s.
ContactScene hairball(const HairballOptions& options);
// Angle of the hairball's turn at time t, rad.
double hairball_angle(double t);

}  // namespace keratin::scenes
