// What the strand passes work on: a quad of four tiles, 64 guides side by side. A quad is worked
// off in blocks of two tiles, each through all its small steps while it sits in the cache. Plain
// data, the same for every instruction set.
//
//   tiled array    tile j of the quad at base + j * rows * components * 16 (schema/layout.h)
//   scratch array  [row][slot][32 lanes], one set a thread; slots below
#pragma once

#include "schema/layout.h"

#include <cstddef>
#include <cstdint>

namespace keratin {

inline constexpr std::size_t kQuadLanes = kQuadTiles * kTileLanes;
// Also the unit in which colliders are sorted out, so the same on every instruction set.
inline constexpr std::size_t kBlockTiles = 2;
inline constexpr std::size_t kBlockLanes = kBlockTiles * kTileLanes;

// Scratch slots: numbers per point that live only while a block is worked on. The row of all slots
// lies together: slots a power of two apart would fall on the same lines of the cache.
enum Slot : std::uint32_t {
    slot_inverse_mass,  // 1 / (mass per line density) (1/m), 0 where a point is carried or absent
    slot_beyond,  // mass beyond the middle of the edge to the parent, per line density, as far as
                  // the joint before carries it (m)
    slot_stiffness,       // h^2 k of the joint at this point, per line density (m)
    slot_pivot,           // 1 / D of the bending system's L D L^T
    slot_band1,           // L, one below the diagonal
    slot_band2,           // L, two below
    slot_inverse_length,  // 1 / length of the edge to the parent (1/m)
    slot_lever,           // how far the grandparent takes part (bend_lever)
    slot_drag,            // h^2 times what slows a turn of the joint's parent, per line density (m)
    slot_along,           // unit rest edge of the joint's parent . rest edge of its child (m)
    slot_x,
    slot_y,
    slot_z,  // right-hand side, then directions of the segments
    slot_sweep1,
    slot_sweep2,  // elimination of the stretch system
    slot_count
};
// Floats of one row.
inline constexpr std::size_t kScratchRow = slot_count * kBlockLanes;

// Values per lane at the begin and end of the step, and at the small step: a row of lanes each.
enum RootSlot : std::uint32_t {
    root_begin = 0,  // x0, x1, u: 9 rows
    root_end = 9,    // 9 rows
    root_slot_count = 18
};

enum class ShapeKind : std::uint32_t { capsule, box, plane, grid };

// One collider during one small step. Lengths m, relative to the simulation's origin.
struct ColliderPose {
    // World to the shape's own space: x -> to_own (x - place); rows of the matrix.
    float to_own[9];
    float place[3];
    // Where the material point now at x was at the start of the small step: from_now x +
    // from_place.
    float from_now[9];
    float from_place[3];
    // A capsule's core in the world, so that it needs no change of space: start and extent.
    float core[3], core_way[3];
    // World bounds of the surface plus its contact distance, as a box and as a ball.
    float bounds_min[3], bounds_max[3];
    float middle[3], reach_square;
};

// A trilinear grid of distances (settings.h DistanceGrid).
struct DistanceNodes {
    const float* distance = nullptr;
    // A sparse grid: per brick of cells where its nodes stand (schema/layout.h). Null: all nodes, x
    // fastest.
    const std::uint32_t* brick = nullptr;
    float origin[3] = {};
    float inverse_spacing = 0, spacing = 0;
    std::uint32_t nodes[3] = {};
};

struct ColliderShapeData {
    ShapeKind kind = ShapeKind::capsule;
    // capsule: a, ab, 1/|ab|^2, radius; box: centre, half size; plane: point, normal.
    float a[3] = {}, b[3] = {};
    float inverse_square = 0, radius = 0;
    float friction = 0;
    float distance = 0;  // kept to the surface
    // Carried with the body: a point may stay as deep as it is in the groom at rest. Then the rest
    // pose to the shape's own space.
    std::uint32_t allows_rest_depth = 0;
    float rest_to_own[9] = {};
    float rest_place[3] = {};
    DistanceNodes grid;
};

// A wave of the turbulent part of the wind: direction * sin(2 pi (k.x + phase)).
inline constexpr int kWindWaves = 6;
struct WindWave {
    float k[3];          // 1/m
    float direction[3];  // m/s
    float phase;         // turns, at this small step
};

struct SmallStep {
    float fraction = 0;          // of the step at the end of the small step, (0, 1]
    float fraction_before = 0;   // and at its begin, [0, 1)
    float step_ratio = 1;        // h / h-
    float half_square = 0;       // h (h + h-) / 2, s^2
    float elastic_share = 1;     // half_square / h^2: what elastic forces count of h^2 k
    float inverse_step = 0;      // 1 / h, 1/s
    float inverse_previous = 0;  // 1 / h-, 1/s
    float gravity[3] = {};
    float wind[3] = {};  // m/s, mean wind with gust now
    WindWave wave[kWindWaves] = {};
    const ColliderPose* colliders = nullptr;
    float thrown = 0;  // m, that a fast collider goes: hair that it hits may be as fast
};

// Parameters of a group for quads of one number of rows, per point from root to tip.
struct QuadClass {
    float keep[kStrandMaxPoints];      // (1 - damping)^(60 h)
    float drag[kStrandMaxPoints];      // 1/s, wind response times the drag rate
    float friction[kStrandMaxPoints];  // share of the grid's displacement this step
    float volume[kStrandMaxPoints];    // m^2/s^2
    float stiffness_step = 0;          // h^2 E I / (density area), m^4
    float weight_step[3] = {};         // h^2 gravity, m
    float bend_damping = 0;            // relaxation time of bending over the small step
    float held = 0;                    // 1 where segments have tension, else 0
    float pull = 0;                    // global length factor of a small step
    float length_damping = 0;
};

// Time spent (runtime/pass/ticks.h).
struct SweepTicks {
    std::uint64_t prepare = 0;
    std::uint64_t predict = 0;  // root to tip: integrate, local_shape's forces
    std::uint64_t tense = 0;    // tip to root: local_shape's moves, stretch's elimination
    std::uint64_t settle = 0;   // root to tip: stretch's moves, collide, final_length
};

struct StepFlags {
    std::uint32_t has_wind = 0, has_turbulence = 0;
    std::uint32_t stretch = 1, local_shape = 1, collision = 0, final_length = 1;
};

struct Quad {
    std::uint32_t rows = 0;
    float* position = nullptr;
    float* previous = nullptr;
    const float* length = nullptr;        // rest lengths
    const float* shape = nullptr;         // row 0: the root's director
    const float* edge = nullptr;          // unloaded edges in the root's frame
    const float* rest = nullptr;          // rest positions
    const float* filling_rest = nullptr;  // [row][2][16] a tile: see grid.h; null: no volume
    // Root transforms: quaternion (4) and translation (3), components 16 lanes apart; tiles
    // root_stride floats apart (0: one for all).
    const float* root_begin = nullptr;
    const float* root_end = nullptr;
    std::size_t root_stride = 0;
    const QuadClass* group = nullptr;
    float* scratch = nullptr;       // [rows][slot_count][32]
    float* root_scratch = nullptr;  // [root_slot_count][32]
    std::uint32_t* near = nullptr;  // [collider_count], those that reach a block
    SweepTicks* ticks = nullptr;
    const ColliderShapeData* shapes = nullptr;
    std::uint32_t collider_count = 0;
    StepFlags flags;
    float bounds_min[3] = {}, bounds_max[3] = {};  // of all points, out of check()
    float fastest = 0;                             // largest |x - x_previous|^2, out of check()
};

}  // namespace keratin
