// The passes of a rod step over one block: strands side by side, one a lane, rows from root to tip.
// They are compiled once for each instruction set; a block has as many lanes as that set's pack.
//
// A block has `vertex_count` V rows, those of its longest strand. An array "[n]" below has n * lanes
// numbers, lane fastest. Edge i leads from vertex i to i + 1; beyond a strand's last vertex edges are
// virtual: they have the tip's tangent and director and no stiffness. Joint i sits on vertex i,
// between the edges i - 1 and i; joint 0 begins with the virtual edge of a clamped root.
#pragma once

#include "runtime/lane/instruction_set.h"

#include <cstddef>
#include <cstdint>

namespace keratin {

inline constexpr std::size_t kRodHalfBand = 10;
inline constexpr std::size_t kRodBandWidth = kRodHalfBand + 1;
// Rows of zeros before and after a band matrix, and before and after a solved vector.
inline constexpr std::size_t kRodPadRows = kRodHalfBand;
// Numbers of a frame: tangent, reference director, reference twist of the joint at its start.
inline constexpr std::size_t kRodFrame = 7;
// Numbers of an edge: stretch stiffness EA/|e| (N/m), rest length (m).
inline constexpr std::size_t kRodEdge = 2;
// Numbers of a joint, as JointMaterial in rod_energy.h.
inline constexpr std::size_t kRodJoint = 8;
inline constexpr std::size_t kRodStrain = 6;
inline constexpr std::uint32_t kRodMaxLanes = 8;

struct RodBlock {
    std::uint32_t vertex_count = 0;     // V
    std::uint32_t min_edge_count = 0;   // edges that every lane has
    double step = 0;                    // s, h
    const double* edge_count = nullptr;   // [1]
    const double* spin_weight = nullptr;  // [1] m, length that an angle counts with in norms
    const double* x_t0 = nullptr;         // [4 V] m, rad
    const double* v_t0 = nullptr;         // [4 V] m/s, rad/s
    // The terms of g(v) that are diagonal in v, as 1/2 weight (v - target)^2 less its value at v_t0
    // (so that neither a long step nor a fast strand drowns the rest in rounding).
    const double* weight = nullptr;          // [4 V] kg, kg m^2
    const double* target = nullptr;          // [4 V] m/s, rad/s
    const double* edges = nullptr;           // [V][kRodEdge]
    const double* joints = nullptr;          // [V][kRodJoint]
    const double* ends = nullptr;            // [12] root tangent, director; tip tangent, director
    const std::uint8_t* free_lanes = nullptr;  // 4 V masks: lanes in which the number is not prescribed
};

// What pulls at the numbers of a block, but for its own elasticity: [4 V] each, and of the scene.
struct RodPull {
    const double* mass;           // kg, kg m^2
    const double* drag;           // kg/s
    const double* spring;         // kg/s^2
    const double* spring_target;  // m, rad
    const double* force;          // N, N m
    double gravity[3], air[3];    // m/s^2, m/s
};

struct RodPasses {
    std::uint32_t lanes;

    // Weight and target of the block (its step, x_t0 and v_t0 are set); reach [1]: m, the largest
    // coordinate.
    void (*prepare)(const RodBlock& block, const RodPull& pull, double* weight, double* target,
                    double* reach);

    // g(v) (METHODS 2.9) and its gradient at v_try = v + alpha d; frames_try are `frames` carried to
    // v_try. energy, scale (sum of the sizes of its terms: what rounding counts from), slope =
    // gradient . d: [1].
    void (*evaluate)(const RodBlock& block, const double* v, const double* d, const double* alpha,
                     const double* frames, double* v_try, double* frames_try, double* gradient,
                     double* energy, double* scale, double* slope);
    // Strains at the start of the step, [V][6]: length of edge i; omega of joint i on both edges, its
    // twist.
    void (*measure)(const RodBlock& block, const double* frames, double* strains);
    // The lower band of the Hessian of g at v, where `frames` are based. Row r, column c at
    // band[(r * 11 + 10 - (r - c))]. exact [1]: 1 whole, 0 positive definite for sure.
    void (*assemble)(const RodBlock& block, const double* v, const double* frames,
                     const double* exact, double* band);
    // L D L^T in place: row r holds L's ten entries and 1/D. Returns the lanes in which a pivot was
    // not positive. The pad rows must hold zeros.
    std::uint32_t (*factor)(std::size_t rows, double* band);
    // d = -(L D L^T)^-1 gradient. norm_square = |d|^2 with angles counted as lengths, slope =
    // gradient . d: [1]. d has pad rows of zeros around it.
    void (*solve)(const RodBlock& block, const double* band, const double* gradient, double* d,
                  double* norm_square, double* slope);
    // The rows from `first` on of x = (L D L^T)^-1 x, in place, for three vectors side by side in
    // each row: [rows][3], with pad rows, 0 before `first`.
    void (*apply_inverse)(std::size_t first, std::size_t rows, const double* band, double* x);
    // ahead = v, in the given lanes v + d; [4 V] each.
    void (*look_ahead)(const RodBlock& block, std::uint32_t moving, const double* v,
                       const double* d, double* ahead);
    // Impulses `change` (N s, N m s) more on the free numbers: they move the block's target, and
    // with it the gradient, energy and scale [1] at v. Returns the lanes that have any.
    std::uint32_t (*push)(const RodBlock& block, const double* change, const double* v,
                          double* target, double* gradient, double* energy, double* scale);
    // x += h v and v_t0 = v in the given lanes; with the midpoint rule v_t0 = 2 v - v_t0 of what is
    // free. Lanes with a number that is not finite are left as they are, at rest; returns them.
    std::uint32_t (*move)(const RodBlock& block, std::uint32_t moving, double h, bool midpoint,
                          const double* v, double* x, double* v_t0);
    // to = from in the given lanes, [count].
    void (*keep)(std::size_t count, std::uint32_t lanes_kept, const double* from, double* to);
};

// The passes for an instruction set, as chosen by usable_instruction_set and built.
const RodPasses& rod_passes(InstructionSet wanted);

}  // namespace keratin
