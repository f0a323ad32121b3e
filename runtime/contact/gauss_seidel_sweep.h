// The inner loop of the Gauss-Seidel contact solve: contacts in batches of eight that share no
// strand, each batch solved side by side. Compiled once for each instruction set.
#pragma once

#include "runtime/lane/instruction_set.h"

#include <cstddef>
#include <cstdint>

namespace keratin {

inline constexpr std::uint32_t kContactBatch = 8;
inline constexpr std::size_t kBatchImpulses = 3 * kContactBatch;
inline constexpr std::uint32_t kNoSide = 0xffffffffu;

// Eight contacts; those beyond the last have no side and open for good. [8] lanes a number.
struct alignas(64) ContactBatch {
    double w[6][kContactBatch];  // 1/kg: own block of the Delassus operator, nn n1 n2 11 12 22
    double constant[3][kContactBatch];  // m/s: gap over the step, minus the obstacle's velocity
    double friction[kContactBatch];
    double impulse[3][kContactBatch];      // N s, in the contact's frame
    double eased[kContactBatch];           // m/s: change of constant[0] by `ease` so far
    std::uint32_t side[2][kContactBatch];  // index into SweepView::sides or kNoSide
};

// A side of a contact at its strand: where it reads its three velocities, and what its impulse adds
// to the strand's numbers.
struct SweepSide {
    std::size_t column;  // three columns of `rows` numbers at columns + column
    std::size_t state;   // the strand's numbers at state + state
    std::uint32_t rows;  // a multiple of 8
    std::uint32_t read;  // the side's own numbers within them
    std::uint32_t
        dense;        // 0: the numbers are contact velocities, three at `read`;
                      // 1: they are the strand's velocities, seven at `read`, read through `row`
    std::size_t row;  // 3 x 7 weights at rows_of + row
};

struct SweepView {
    ContactBatch* batches;
    const SweepSide* sides;
    const float* columns;  // aligned to 32
    double* state;         // aligned to 64
    const double* rows_of;
    double velocity_scale, impulse_scale;  // 1 / u*, 1 / (u* mean mass), METHODS 2.10
};

struct SweepKernels {
    // One Gauss-Seidel pass over batches begin..end, in order. Returns the sum of |r_new - r_old|.
    double (*sweep)(const SweepView& view, std::size_t begin, std::size_t end);
    // Sum of |f_FB| over batches begin..end.
    double (*residual)(const SweepView& view, std::size_t begin, std::size_t end);
    // Moves the gap of each pressing contact of batches begin..end to where it is met already, by
    // at most `leeway` (m/s) in all calls together.
    void (*ease)(const SweepView& view, std::size_t begin, std::size_t end, double leeway);
    // Sum of |r - before|^2 over batches begin..end; before: [batches] as ContactBatch::impulse.
    double (*square)(const SweepView& view, std::size_t begin, std::size_t end,
                     const double* before);
    // Goes on along the way: value += along way, way = along way + what the sweep changed, before =
    // value. Of the impulses of batches begin..end, and of `count` numbers (a multiple of 8).
    void (*carry_impulses)(const SweepView& view, std::size_t begin, std::size_t end, double along,
                           double* before, double* way);
    void (*carry)(std::size_t count, double along, double* value, double* before, double* way);
};

const SweepKernels& sweep_kernels(InstructionSet wanted);

}  // namespace keratin
