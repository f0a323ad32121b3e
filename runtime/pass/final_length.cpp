// Gives every segment its exact length, from the root outwards, without leaving points inside of
// colliders: each point is pushed out and put back at its distance from the parent in turn.
#include "runtime/formula/length.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/solid.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

// Rounds of push out and put back. On a convex surface of radius R each leaves about l / 2R of the
// depth before, so four bring a millimetre under the float's rounding for hair on a head.
constexpr int kRounds = 16;

void final_length_block(const Block& b, const SmallStep& step, const std::uint32_t* near,
                        std::uint32_t near_count) {
    const Work zero(0.0f), damping(b.quad.group->length_damping);
    Work3 parent = b.x(1);
    Work3 direction = normalize_or(parent - b.x(0), Work3(zero, Work(1.0f), zero));
    for (std::size_t i = 2; i < b.rows; ++i) {
        const Work l = b.length(i);
        const Work3 before = b.x(i);
        Work3 t = normalize_or(before - parent, direction);
        Work3 x = parent + t * l;
        for (int round = 0; round < kRounds && near_count > 0; ++round) {
            // Only lanes that were pushed may change, or results would depend on who their
            // neighbours in the pack are.
            Work pushed = zero;
            Work3 out = x;
            for (std::uint32_t k = 0; k < near_count; ++k) {
                with_shape(b.quad.shapes[near[k]].kind, [&]<ShapeKind kind>() {
                    Work3 normal;
                    const Work depth = depth_in<kind>(b.quad.shapes[near[k]],
                                                      step.colliders[near[k]], b, i, out, normal);
                    const auto inside = zero < depth;
                    if (!any(inside)) return;
                    pushed = select(inside, Work(1.0f), pushed);
                    out = select(inside, out + normal * depth, out);
                });
            }
            const auto again = zero < pushed;
            if (!any(again)) break;
            t = select(again, normalize_or(out - parent, t), t);
            x = select(again, parent + t * l, x);
        }
        const Work3 d = x - before;
        b.set_x(i, x);
        // The velocity that following the parent adds is taken back from the parent (dynamic
        // follow-the-leader).
        if (i > 2) b.set_x_previous(i - 1, b.x_previous(i - 1) + d * damping);
        parent = x;
        direction = t;
    }
}

}  // namespace

void final_length(Quad& quad, const SmallStep& step) {
    constexpr std::uint32_t kNear = 32;
    std::uint32_t near[kNear], near_count = 0;
    if (quad.flags.collision)
        for (std::uint32_t k = 0; k < quad.collider_count && near_count < kNear; ++k)
            if (overlaps(quad, step.colliders[k], 0.05f)) near[near_count++] = k;
    for (std::size_t lane = 0; lane < kQuadLanes; lane += kWorkLanes)
        final_length_block(Block(quad, lane), step, near, near_count);
}

}  // namespace keratin::KERATIN_ISA
