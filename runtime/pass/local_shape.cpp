// Bends each strand towards its groomed shape: one implicit step of the elastic moments of all
// joints, solved directly (METHODS 1.4, local shape, in its vector form).
//
// The source relaxes joint by joint, which at any affordable number of iterations leaves a
// stiffness that depends on the step and the number of points. With the frames taken from the
// predicted positions the moments are linear in the positions, the matrix is the same for x, y and
// z and has two bands below the diagonal; its factors come from prepare(). So one sweep down and
// one up give what infinitely many iterations would, at the cost of one.
#include "runtime/formula/bend.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

void local_shape_block(const Block& b, const SmallStep& step) {
    const std::size_t n = b.rows - 1;
    const Work zero(0.0f);
    const Work3 none(zero, zero, zero);

    const RootNow root = root_now(b, step.fraction);
    const Work3 side = cross(root.direction, root.director);
    Work3 t = root.direction;  // of the parent now
    Work3 r = root.direction;  // of the parent in the unloaded shape, carried by the root
    Work inverse_length = Work(1.0f) / max(b.length(1), Work(1e-12f));
    Work3 x = root.x1;

    Work3 f1 = none, f2 = none, g1 = none;  // F and G of the joint before, F of the one before that
    Work3 y1 = none, y2 = none;
    const Work3 fall = splat(step.gravity) * Work(step.half_square);
    Work above = b.length(2);
    const auto finish_row = [&](std::size_t j, const Work3& force) {
        const Work below = j < n ? b.length(j + 1) : zero;
        const Work mass = select(above < Work(1e-9f), zero, Work(0.5f) * (above + below));
        above = below;
        const Work3 y = force + fall * mass - y1 * b.get(slot_band1, j) - y2 * b.get(slot_band2, j);
        b.set3(slot_x, j, y);
        y2 = y1;
        y1 = y;
    };
    for (std::size_t i = 1; i < n; ++i) {
        const Work3 child = b.x(i + 1);
        const Work3 e = child - x;
        const Work square = dot(e, e);
        const auto tiny = square < Work(1e-24f);
        const Work inverse = Work(1.0f) / sqrt(select(tiny, Work(1.0f), square));
        const Work3 t_next = select(tiny, t, e * inverse);
        // The child's direction at its rest length: stretch is not this pass's matter, and taken as
        // such it would be far stiffer than bending.
        const Work l = b.length(i + 1);
        const Work3 c = b.edge(i + 1);
        const Work3 d = root.direction * c.x + root.director * c.y + side * c.z;
        const Work3 g = minimal_turn(r, t, d);
        const Work3 f = (t_next * l - g) * b.get(slot_stiffness, i);
        const Work3 reaction = bend_reaction(r, t, inverse_length, g, f);
        if (i >= 3) finish_row(i - 1, f1 + g1 - f2 - reaction);
        f2 = f1;
        f1 = f;
        g1 = reaction;

        t = t_next;
        r = d * (Work(1.0f) / max(l, Work(1e-12f)));
        inverse_length = select(tiny, zero, inverse);
        x = child;
    }
    if (n >= 3) finish_row(n - 1, f1 + g1 - f2);
    finish_row(n, -f1);

    Work3 d1 = none, d2 = none;  // moves of the two points further out
    Work l1 = zero, l2_next = zero, l2 = zero;
    for (std::size_t j = n; j >= 2; --j) {
        const Work3 d = b.get3(slot_x, j) * b.get(slot_pivot, j) - d1 * l1 - d2 * l2;
        b.set_x(j, b.x(j) + d);
        d2 = d1;
        d1 = d;
        l2 = l2_next;
        l1 = b.get(slot_band1, j);
        l2_next = b.get(slot_band2, j);
    }
}

}  // namespace

void local_shape(Quad& quad, const SmallStep& step) {
    for (std::size_t lane = 0; lane < kQuadLanes; lane += kWorkLanes)
        local_shape_block(Block(quad, lane), step);
}

}  // namespace keratin::KERATIN_ISA
