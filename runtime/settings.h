// What a simulation of the `strand` solver is asked to do besides its asset: plain values, checked
// by make_plan. SI units, y up, right-handed, quaternions (x, y, z, w).
#pragma once

#include "runtime/host.h"
#include "runtime/lane/instruction_set.h"

#include <array>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

namespace keratin {

// Maps a rest position x (groom space, or a collider's own space) to R x + translation.
struct RigidTransform {
    std::array<double, 3> translation{0, 0, 0};  // m, world
    std::array<double, 4> rotation{0, 0, 0, 1};  // unit
    bool operator==(const RigidTransform&) const = default;
};

struct SphereCollider {
    std::array<float, 3> center{};  // m
    float radius = 0;               // m, > 0
};
struct CapsuleCollider {
    std::array<float, 3> a{}, b{};  // m, ends of the core segment
    float radius = 0;               // m, > 0
};
struct BoxCollider {
    std::array<float, 3> center{}, half_size{};  // m, half_size > 0
};
struct PlaneCollider {
    std::array<float, 3> point{}, normal{0, 1, 0};  // m; unit, out of the solid side
};
// Signed distances at the nodes of a grid, negative inside, x fastest; linear between nodes, no
// contact outside the grid.
struct DistanceGrid {
    std::array<float, 3> origin{};         // m, of node (0, 0, 0)
    float spacing = 0;                     // m, > 0
    std::array<std::uint32_t, 3> nodes{};  // >= 2 each
    std::vector<float> distance;           // [nodes x * y * z] m
};
struct DistanceGridCollider {
    std::shared_ptr<const DistanceGrid> grid;
};
using ColliderShape =
    std::variant<SphereCollider, CapsuleCollider, BoxCollider, PlaneCollider, DistanceGridCollider>;

// A solid that strands stay outside of. It moves by Simulation::set_collider.
struct Collider {
    ColliderShape shape;
    float friction = 0.3f;       // Coulomb, >= 0
    float contact_distance = 0;  // m, kept between a point and the surface; 0: the strand's radius
    RigidTransform motion = {};  // at the start
};

struct Wind {
    std::array<float, 3> velocity{0, 0, 0};  // m/s
    float gust = 0;        // 0..1, share by which the speed swells and falls over seconds
    float turbulence = 0;  // 0..1, share by which it differs from place to place
};

// Passes switched off by hand, for comparisons; what is off is not planned.
struct PassSwitches {
    bool grid_friction = true;
    bool grid_volume = true;
    bool stretch = true;
    bool local_shape = true;
    bool global_length = true;  // both the factor inside the iterations and the last full pass
    bool collision = true;
    bool interpolation = true;
};

enum class OutputPrecision { float32, float16 };

struct Settings {
    std::array<float, 3> gravity{0, -9.81f, 0};  // m/s^2
    Wind wind;
    std::uint64_t seed = 1;  // of the wind
    // Constraint iterations per 1/60 s, 1..64; 0: the asset's. A step of h runs ceil(60 h K) small
    // steps of one iteration each, so that the motion hardly depends on the frame rate; more where a
    // fast collider reaches the hair, and up to four times as many where a root is jerked by more
    // than a segment a small step.
    std::uint32_t iterations = 0;
    int threads = 0;  // 0: as many as OpenMP would take
    // The results do not depend on it.
    InstructionSet instruction_set = InstructionSet::automatic;  // the results do not depend on it
    PassSwitches passes;

    // Share of the render strands that is interpolated, 0..1: a prefix of the asset's order. Can be
    // lowered and raised again at run time up to this value.
    float lod = 1;
    OutputPrecision output = OutputPrecision::float32;
    bool tangents = false;  // also write unit tangents of the render strands (float)
    bool previous = false;  // also keep the render strands of the step before, for motion vectors

    std::vector<Collider> colliders;
    // Colliders of the asset take part and move with it or its bones: its distance grid, or the
    // fitted shapes where it has none.
    bool asset_colliders = true;
    float asset_collider_friction = 0.3f;
    float asset_collider_distance = 0;  // m, as Collider::contact_distance

    std::uint32_t grid_resolution =
        48;  // 8..128 voxels along the longest side of the groom's reach

    // A root that moves further than this in one step (m), or turns by more than a right angle,
    // carries its strand rigidly; <= 0: never.
    float teleport_distance = 0.5f;

    // A group of 64 guides whose points all moved slower than this (m/s) for half a second, with
    // its roots and the colliders near it at rest, is not simulated until one of them moves; <= 0:
    // never.
    float sleep_speed = 0;

    // World position that outputs and the solver count from, so that scenes far from the world's
    // origin keep their precision; see Simulation::set_origin.
    std::array<double, 3> origin{0, 0, 0};

    Host host;
};

}  // namespace keratin
