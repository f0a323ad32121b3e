// What the rod solver is given: explicit strands with their material, rest shape and ends, and the
// settings of a run. Plain values, SI units, y up. Checked by RodSimulation::create.
#pragma once

#include "runtime/lane/instruction_set.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace keratin {

using Double3 = std::array<double, 3>;

// How an end of a strand is held (METHODS §2.2).
//   free                nothing is prescribed
//   pinned              the position
//   clamped             position, tangent and director: convention A, the first joint has half a
//                       segment's length and sits on the clamp (order 2)
//   clamped_two_points  the last two points and the angle of the edge between them (order 1)
enum class RodEnd { free, pinned, clamped, clamped_two_points };

struct RodMaterial {
    std::array<double, 2> radii{5e-5, 5e-5};  // m, > 0: semi-axes along the directors m_1 and m_2
    double density = 1300;                    // kg/m^3, > 0
    double youngs_modulus = 2e9;              // Pa, > 0
    double poisson_ratio = 0.48;              // (-1, 0.5]
    double viscosity = 0;                     // Pa s, >= 0
    double air_drag = 0;                      // N s/m^2: per length and speed, >= 0
    bool operator==(const RodMaterial&) const = default;
};

// Directions that an end is clamped to. Unit vectors; the normal is made perpendicular to the
// tangent. Both are the first (last) rest edge's where they are left out.
struct RodEndFrame {
    std::optional<Double3> tangent;  // root to tip, at either end
    std::optional<Double3> normal;   // director m_1
};

// Elastic strain of an edge and of the joint at its start, joint 0 at a clamped root. omega as in
// METHODS §2.2 (2 tan of half the angle), in the frames without twist that rest points have.
struct RodStrain {
    double stretch = 0;            // |e|/|e_rest| - 1, > -1
    std::array<double, 2> bend{};  // omega - omega_rest about m_2 and -m_1
    double twist = 0;              // rad
    bool operator==(const RodStrain&) const = default;
};

struct RodStrand {
    std::vector<Double3> points;      // [2..] m, initial positions, root first
    std::vector<Double3> velocities;  // [points] m/s, or empty: at rest
    std::vector<double> angles;       // [points - 1] rad, angle of each edge's material director
                                      // about its initial reference director, or empty: 0
    // Rest shape: rest_points, or else `points`, with the edges' lengths; its curvature and twist
    // unless natural_curvature is given.
    std::vector<Double3> rest_points;                        // [points] m, or empty
    std::optional<std::array<double, 2>> natural_curvature;  // 1/m about m_1 and m_2
    double natural_twist = 0;                                // 1/m
    // Strain that the rest points' shape is under, as hair is that bears its weight where it was
    // groomed: the rest shape lacks it. Not with natural_curvature.
    std::vector<RodStrain> rest_strain;  // [points - 1], or empty: none
    RodMaterial material;
    std::vector<double> added_mass;  // [points] kg, or empty: beads
    RodEnd root = RodEnd::clamped, tip = RodEnd::free;
    RodEndFrame root_frame, tip_frame;
};

enum class RodNewton { quasi, full };

// How a step is taken.
//   euler     implicit Euler (METHODS §2.3): order 1 in the step, takes energy out of every motion
//   midpoint  the same solve for the middle of the step, x_1 = 2 x_m - x_0: order 2, keeps the energy of
//             what the step resolves, and lets what it does not resolve ring instead of dying out.
//             **Beyond** METHODS. Not with contact, whose law belongs to the end of a step.
enum class RodIntegrator { euler, midpoint };

struct RodSettings {
    Double3 gravity{0, -9.81, 0};  // m/s^2
    Double3 air_velocity{0, 0, 0};  // m/s, for air_drag
    double stretch_scale = 1, bend_scale = 1, twist_scale = 1;  // of stiffness and viscosity, > 0
    RodNewton newton = RodNewton::quasi;
    RodIntegrator integrator = RodIntegrator::euler;
    std::uint32_t iterations = 50;  // >= 1, of one step, before it is repeated in halves
    double tolerance = 1e-8;        // m/s: mean change of the velocity in an iteration
    std::uint32_t halvings = 6;     // how often a step that does not converge may be halved
    // The same where the contacts do not converge, and where strands turn past each other so far in
    // the step that they end it overlapping by more than 1 %.
    std::uint32_t contact_halvings = 3, overlap_halvings = 5;
    int threads = 0;                // 0: as many as OpenMP would take
    InstructionSet instruction_set = InstructionSet::automatic;
};

}  // namespace keratin
