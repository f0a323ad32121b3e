// How a pass walks a quad: blocks of as many lanes as the instruction set works on at a time, each
// with its rows.
#pragma once

#include "runtime/lane/lanes.h"
#include "runtime/pass/quad.h"

namespace keratin::KERATIN_ISA {

using Work3 = Vec3<Work>;

// Lanes lane .. lane + kWorkLanes of a quad.
struct Block {
    const Quad& quad;
    std::size_t lane;  // first lane, multiple of 16
    std::size_t rows;

    KERATIN_ALWAYS_INLINE Block(const Quad& q, std::size_t first)
        : quad(q), lane(first), rows(q.rows) {}

    KERATIN_ALWAYS_INLINE std::size_t tile(std::size_t components) const {
        return lane / kTileLanes * rows * components * kTileLanes;
    }
    KERATIN_ALWAYS_INLINE std::size_t stride(std::size_t components) const {
        return rows * components * kTileLanes;
    }
    KERATIN_ALWAYS_INLINE float* position(std::size_t row) const {
        return quad.position + tile(3) + row * 3 * kTileLanes;
    }
    KERATIN_ALWAYS_INLINE float* previous(std::size_t row) const {
        return quad.previous + tile(3) + row * 3 * kTileLanes;
    }
    KERATIN_ALWAYS_INLINE Work3 x(std::size_t row) const {
        return load3<Work>(position(row), stride(3));
    }
    KERATIN_ALWAYS_INLINE Work3 x_previous(std::size_t row) const {
        return load3<Work>(previous(row), stride(3));
    }
    KERATIN_ALWAYS_INLINE void set_x(std::size_t row, const Work3& v) const {
        store3(v, position(row), stride(3));
    }
    KERATIN_ALWAYS_INLINE void set_x_previous(std::size_t row, const Work3& v) const {
        store3(v, previous(row), stride(3));
    }
    KERATIN_ALWAYS_INLINE Work length(std::size_t row) const {
        return load<Work>(quad.length + tile(1) + row * kTileLanes, stride(1));
    }
    KERATIN_ALWAYS_INLINE Work3 shape(std::size_t row) const {
        return load3<Work>(quad.shape + tile(3) + row * 3 * kTileLanes, stride(3));
    }
    KERATIN_ALWAYS_INLINE Work3 edge(std::size_t row) const {
        return load3<Work>(quad.edge + tile(3) + row * 3 * kTileLanes, stride(3));
    }
    KERATIN_ALWAYS_INLINE Work3 rest(std::size_t row) const {
        return load3<Work>(quad.rest + tile(3) + row * 3 * kTileLanes, stride(3));
    }
    KERATIN_ALWAYS_INLINE float* slot(std::uint32_t s, std::size_t row) const {
        return quad.scratch + scratch_index(s, quad.rows, std::uint32_t(row)) + lane;
    }
    KERATIN_ALWAYS_INLINE Work get(std::uint32_t s, std::size_t row) const {
        return load<Work>(slot(s, row), kTileLanes);
    }
    KERATIN_ALWAYS_INLINE void set(std::uint32_t s, std::size_t row, const Work& v) const {
        store(v, slot(s, row), kTileLanes);
    }
    KERATIN_ALWAYS_INLINE Work3 get3(std::uint32_t s, std::size_t row) const {
        return Work3(get(s, row), get(s + 1, row), get(s + 2, row));
    }
    KERATIN_ALWAYS_INLINE void set3(std::uint32_t s, std::size_t row, const Work3& v) const {
        set(s, row, v.x);
        set(s + 1, row, v.y);
        set(s + 2, row, v.z);
    }
    KERATIN_ALWAYS_INLINE Work3 root3(std::uint32_t s) const {
        const float* p = quad.root_scratch + s * kQuadLanes + lane;
        return Work3(load<Work>(p, kTileLanes), load<Work>(p + kQuadLanes, kTileLanes),
                     load<Work>(p + 2 * kQuadLanes, kTileLanes));
    }
    KERATIN_ALWAYS_INLINE void set_root3(std::uint32_t s, const Work3& v) const {
        float* p = quad.root_scratch + s * kQuadLanes + lane;
        store(v.x, p, kTileLanes);
        store(v.y, p + kQuadLanes, kTileLanes);
        store(v.z, p + 2 * kQuadLanes, kTileLanes);
    }
};

KERATIN_ALWAYS_INLINE Work3 splat(const float (&v)[3]) {
    return Work3(Work(v[0]), Work(v[1]), Work(v[2]));
}
// A matrix given by rows times a vector.
KERATIN_ALWAYS_INLINE Work3 times(const float (&m)[9], const Work3& v) {
    return Work3(Work(m[0]) * v.x + Work(m[1]) * v.y + Work(m[2]) * v.z,
                 Work(m[3]) * v.x + Work(m[4]) * v.y + Work(m[5]) * v.z,
                 Work(m[6]) * v.x + Work(m[7]) * v.y + Work(m[8]) * v.z);
}
KERATIN_ALWAYS_INLINE Work3 transposed_times(const float (&m)[9], const Work3& v) {
    return Work3(Work(m[0]) * v.x + Work(m[3]) * v.y + Work(m[6]) * v.z,
                 Work(m[1]) * v.x + Work(m[4]) * v.y + Work(m[7]) * v.z,
                 Work(m[2]) * v.x + Work(m[5]) * v.y + Work(m[8]) * v.z);
}

// The root frame's first segment at the fraction s of the step: points 0 and 1 move evenly, the
// segment keeps its length.
struct RootNow {
    Work3 x0, x1, direction, director;
};
KERATIN_ALWAYS_INLINE RootNow root_now(const Block& b, float fraction) {
    const Work s(fraction);
    const Work3 x0_a = b.root3(root_begin), x0_b = b.root3(root_end);
    const Work3 x1_a = b.root3(root_begin + 3), x1_b = b.root3(root_end + 3);
    const Work3 u_a = b.root3(root_begin + 6), u_b = b.root3(root_end + 6);
    RootNow r;
    r.x0 = x0_a + (x0_b - x0_a) * s;
    const Work3 e = x1_a + (x1_b - x1_a) * s - r.x0;
    r.direction = normalize_or(e, Work3(Work(0.0f), Work(1.0f), Work(0.0f)));
    r.x1 = r.x0 + r.direction * b.length(1);
    const Work3 u = u_a + (u_b - u_a) * s;
    r.director =
        normalize_or(u - r.direction * dot(r.direction, u), any_perpendicular(r.direction));
    return r;
}

}  // namespace keratin::KERATIN_ISA
