// Moves free points by their inertia, gravity and wind; carried points follow their root
// (METHODS 1.3).
#include "runtime/formula/verlet.h"
#include "runtime/formula/wind.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

enum class Air { still, steady, turbulent };

template <Air air>
void integrate_block(const Block& b, const SmallStep& step) {
    const QuadClass& group = *b.quad.group;
    const RootNow root = root_now(b, step.fraction);
    b.set_x_previous(0, b.x(0));
    b.set_x_previous(1, b.x(1));
    b.set_x(0, root.x0);
    b.set_x(1, root.x1);

    const Work half_square(step.half_square);
    Work3 parent_move = root.x1 - b.x_previous(1);
    // Gravity enters with the elastic forces where there are any, so that at rest both are taken at
    // the same place (local_shape.cpp).
    const Work3 gravity = b.quad.flags.local_shape ? Work3(Work(0.0f)) : splat(step.gravity);
    for (std::size_t i = 2; i < b.rows; ++i) {
        const Work3 x = b.x(i), previous = b.x_previous(i);
        Work3 a = gravity;
        if constexpr (air != Air::still) {
            Work3 wind = splat(step.wind);
            if constexpr (air == Air::turbulent) {
                for (const WindWave& w : step.wave)
                    wind += splat(w.direction) * wave_at(x, splat(w.k), Work(w.phase));
            }
            const Work3 velocity = (x - previous) * Work(step.inverse_previous);
            a += wind_acceleration(wind, velocity, Work(group.drag[i]), Work(step.inverse_step));
        }
        const Work carry(step.step_ratio * group.keep[i]);
        b.set_x_previous(i, x);
        Work3 move = verlet_move(x, previous, carry, a, half_square);
        const Work longest = longest_turn(b.length(i)) + Work(step.thrown);
        const Work3 beside = move - parent_move;
        if (any(longest * longest < dot(beside, beside)))
            move = resolved_move(move, parent_move, longest);
        b.set_x(i, x + move);
        parent_move = move;
    }
}

}  // namespace

void integrate(Quad& quad, const SmallStep& step) {
    for (std::size_t lane = 0; lane < kQuadLanes; lane += kWorkLanes) {
        const Block b(quad, lane);
        if (quad.flags.has_turbulence)
            integrate_block<Air::turbulent>(b, step);
        else if (quad.flags.has_wind)
            integrate_block<Air::steady>(b, step);
        else
            integrate_block<Air::still>(b, step);
    }
}

}  // namespace keratin::KERATIN_ISA
