// Moves points out of the colliders that reach their quad, with Coulomb friction against the
// surface's own motion (METHODS 1.4, collision).
#include "runtime/formula/contact.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/solid.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

template <ShapeKind kind>
void collide_block(const Block& b, const ColliderShapeData& shape, const ColliderPose& pose) {
    const Work zero(0.0f), friction(shape.friction);
    for (std::size_t i = 2; i < b.rows; ++i) {
        const Work3 x = b.x(i);
        Work3 normal;
        const Work depth = depth_in<kind>(shape, pose, b, i, x, normal);
        const auto inside = zero < depth;
        if (!any(inside)) continue;
        const Work push = select(inside, depth, zero);
        const Work3 out = x + normal * push;
        const Work3 surface_before = times(pose.from_now, out) + splat(pose.from_place);
        const Work3 slide = surface_before - b.x_previous(i);
        const Work3 moved = out + friction_move(slide, normal, push, friction);
        b.set_x(i, select(inside, moved, x));
    }
}

}  // namespace

void collide(Quad& quad, const SmallStep& step) {
    for (std::uint32_t k = 0; k < quad.collider_count; ++k) {
        const ColliderPose& pose = step.colliders[k];
        if (!overlaps(quad, pose, 0.0f)) continue;
        const ColliderShapeData& shape = quad.shapes[k];
        with_shape(shape.kind, [&]<ShapeKind kind>() {
            for (std::size_t lane = 0; lane < kQuadLanes; lane += kWorkLanes)
                collide_block<kind>(Block(quad, lane), shape, pose);
        });
    }
}

}  // namespace keratin::KERATIN_ISA
