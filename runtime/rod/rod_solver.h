// How a block of strands gets from the start of a step, or of a part of it, to its end: its problem
// for Newton's method, and what becomes of the answer (METHODS §2.3). Of rod_step.cpp and
// rod_scene_step.cpp.
#pragma once

#include "runtime/rod/rod_step.h"

#include <chrono>

namespace keratin {

// The part of the whole step from share s0 to s1 of it that is being solved.
struct RodPart {
    double h = 0;  // s, of the part
    double s0 = 0, s1 = 1;
};

struct RodSolver {
    RodStepper& r;
    const RodPasses& passes;
    RodBlocks& blocks;
    std::uint32_t lanes;

    explicit RodSolver(RodStepper& stepper)
        : r(stepper),
          passes(*stepper.passes),
          blocks(stepper.blocks),
          lanes(stepper.blocks.lanes) {}

    // No more than there are blocks: waking a thread costs more than a small block.
    int threads() const;
    NewtonRules rules() const { return {r.settings.tolerance, r.settings.newton}; }
    // Pieces that the strand's step is cut into because an end turns far: a power of two.
    std::uint32_t pieces(std::size_t s) const;

    // Sets the block's problem and its first guess.
    void begin(RodWorkspace& w, std::size_t b, std::uint32_t mask, const RodPart& part);
    // The result becomes the state of the lanes in `mask`.
    void commit(RodWorkspace& w, std::size_t b, std::uint32_t mask, const RodPart& part);
    // Adds what the lanes in `mask` took to the report.
    void count(const RodWorkspace& w, std::uint32_t mask, RodStepReport& report) const;
    // The whole step is done: the held ends have arrived.
    void arrive();

  private:
    void prescribe(RodWorkspace& w, std::size_t s, std::size_t vertex, const Double3& x, double h);
    double angle_to(std::size_t s, std::size_t edge, const Double3& tangent,
                    const Double3& director);
    void hold_end(RodWorkspace& w, std::size_t s, const RodEndState& end, bool root,
                  const RodPart& part);
    void prepare(RodWorkspace& w, std::size_t b, const RodPart& part);
    void add_viscosity(RodWorkspace& w, std::size_t b, double h);
    std::uint32_t rigid_guess(RodWorkspace& w, std::size_t b, std::uint32_t mask,
                              const RodPart& part);
    void set_held(std::size_t s, const RodEndState& end, std::size_t vertex, std::size_t second,
                  double share);
    void carry_frames(RodWorkspace& w, std::size_t b, std::uint32_t mask, const RodPart& part);
};

inline double seconds_now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

}  // namespace keratin
