// How a pass walks a block of a quad: parts of as many lanes as it works on at a time, each with
// its rows.
#pragma once

#include "runtime/lane/lanes.h"
#include "runtime/pass/quad.h"

namespace keratin::KERATIN_ISA {

using Work3 = Vec3<Work>;

// Lanes first .. first + Pack::kLanes of a quad. Sweeps take it by value: what it points to is then
// known to be its own, and the pointers stay in registers.
template <class Pack>
struct Part {
    using Pack3 = Vec3<Pack>;

    std::size_t rows;
    float* position;
    float* previous;
    const float* lengths;
    const float* edges;
    const float* rests;
    const float* shapes;
    float* scratch;
    float* root_scratch;

    KERATIN_ALWAYS_INLINE Part(const Quad& q, std::size_t first) : rows(q.rows) {
        const std::size_t scalars = first / kTileLanes * rows * kTileLanes + first % kTileLanes;
        const std::size_t vectors = first / kTileLanes * rows * 3 * kTileLanes + first % kTileLanes;
        position = q.position + vectors;
        previous = q.previous + vectors;
        lengths = q.length + scalars;
        edges = q.edge + vectors;
        rests = q.rest + vectors;
        shapes = q.shape + vectors;
        scratch = q.scratch + first % kBlockLanes;
        root_scratch = q.root_scratch + first % kBlockLanes;
    }

    KERATIN_ALWAYS_INLINE Pack3 vector(const float* tiled, std::size_t row) const {
        return load3<Pack>(tiled + row * 3 * kTileLanes, rows * 3 * kTileLanes);
    }
    KERATIN_ALWAYS_INLINE Pack3 x(std::size_t row) const { return vector(position, row); }
    KERATIN_ALWAYS_INLINE Pack3 x_previous(std::size_t row) const { return vector(previous, row); }
    KERATIN_ALWAYS_INLINE void set_x(std::size_t row, const Pack3& v) const {
        store3(v, position + row * 3 * kTileLanes, rows * 3 * kTileLanes);
    }
    KERATIN_ALWAYS_INLINE void set_x_previous(std::size_t row, const Pack3& v) const {
        store3(v, previous + row * 3 * kTileLanes, rows * 3 * kTileLanes);
    }
    KERATIN_ALWAYS_INLINE Pack length(std::size_t row) const {
        return load<Pack>(lengths + row * kTileLanes, rows * kTileLanes);
    }
    KERATIN_ALWAYS_INLINE Pack3 shape(std::size_t row) const { return vector(shapes, row); }
    KERATIN_ALWAYS_INLINE Pack3 edge(std::size_t row) const { return vector(edges, row); }
    KERATIN_ALWAYS_INLINE Pack3 rest(std::size_t row) const { return vector(rests, row); }

    KERATIN_ALWAYS_INLINE float* slot(std::uint32_t s, std::size_t row) const {
        return scratch + row * kScratchRow + s * kBlockLanes;
    }
    KERATIN_ALWAYS_INLINE Pack get(std::uint32_t s, std::size_t row) const {
        return load<Pack>(slot(s, row), kTileLanes);
    }
    KERATIN_ALWAYS_INLINE void set(std::uint32_t s, std::size_t row, const Pack& v) const {
        store(v, slot(s, row), kTileLanes);
    }
    KERATIN_ALWAYS_INLINE Pack3 get3(std::uint32_t s, std::size_t row) const {
        return Pack3(get(s, row), get(s + 1, row), get(s + 2, row));
    }
    KERATIN_ALWAYS_INLINE void set3(std::uint32_t s, std::size_t row, const Pack3& v) const {
        set(s, row, v.x);
        set(s + 1, row, v.y);
        set(s + 2, row, v.z);
    }
    KERATIN_ALWAYS_INLINE Pack3 root3(std::uint32_t s) const {
        const float* p = root_scratch + s * kBlockLanes;
        return Pack3(load<Pack>(p, kTileLanes), load<Pack>(p + kBlockLanes, kTileLanes),
                     load<Pack>(p + 2 * kBlockLanes, kTileLanes));
    }
    KERATIN_ALWAYS_INLINE void set_root3(std::uint32_t s, const Pack3& v) const {
        float* p = root_scratch + s * kBlockLanes;
        store(v.x, p, kTileLanes);
        store(v.y, p + kBlockLanes, kTileLanes);
        store(v.z, p + 2 * kBlockLanes, kTileLanes);
    }
};

template <class Pack>
KERATIN_ALWAYS_INLINE Vec3<Pack> splat(const float (&v)[3]) {
    return Vec3<Pack>(Pack(v[0]), Pack(v[1]), Pack(v[2]));
}
// A matrix given by rows times a vector.
template <class Pack>
KERATIN_ALWAYS_INLINE Vec3<Pack> times(const float (&m)[9], const Vec3<Pack>& v) {
    return Vec3<Pack>(Pack(m[0]) * v.x + Pack(m[1]) * v.y + Pack(m[2]) * v.z,
                      Pack(m[3]) * v.x + Pack(m[4]) * v.y + Pack(m[5]) * v.z,
                      Pack(m[6]) * v.x + Pack(m[7]) * v.y + Pack(m[8]) * v.z);
}
template <class Pack>
KERATIN_ALWAYS_INLINE Vec3<Pack> transposed_times(const float (&m)[9], const Vec3<Pack>& v) {
    return Vec3<Pack>(Pack(m[0]) * v.x + Pack(m[3]) * v.y + Pack(m[6]) * v.z,
                      Pack(m[1]) * v.x + Pack(m[4]) * v.y + Pack(m[7]) * v.z,
                      Pack(m[2]) * v.x + Pack(m[5]) * v.y + Pack(m[8]) * v.z);
}

// The root frame's first segment at the fraction s of the step: points 0 and 1 move evenly, the
// segment keeps its length.
template <class Pack>
struct RootNow {
    Vec3<Pack> x0, x1, direction, director;
};
template <class Pack>
KERATIN_ALWAYS_INLINE RootNow<Pack> root_now(const Part<Pack>& b, float fraction) {
    using Pack3 = Vec3<Pack>;
    const Pack s(fraction);
    const Pack3 x0_a = b.root3(root_begin), x0_b = b.root3(root_end);
    const Pack3 x1_a = b.root3(root_begin + 3), x1_b = b.root3(root_end + 3);
    const Pack3 u_a = b.root3(root_begin + 6), u_b = b.root3(root_end + 6);
    RootNow<Pack> r;
    r.x0 = x0_a + (x0_b - x0_a) * s;
    const Pack3 e = x1_a + (x1_b - x1_a) * s - r.x0;
    r.direction = normalize_or(e, Pack3(Pack(0.0f), Pack(1.0f), Pack(0.0f)));
    r.x1 = r.x0 + r.direction * b.length(1);
    const Pack3 u = u_a + (u_b - u_a) * s;
    r.director =
        normalize_or(u - r.direction * dot(r.direction, u), any_perpendicular(r.direction));
    return r;
}

// Rotation vector of the root's frame from one moment to a near one.
template <class Pack>
KERATIN_ALWAYS_INLINE Vec3<Pack> root_turn(const RootNow<Pack>& from, const RootNow<Pack>& to) {
    return (cross(from.direction, to.direction) + cross(from.director, to.director) +
            cross(cross(from.direction, from.director), cross(to.direction, to.director))) *
           Pack(0.5f);
}

}  // namespace keratin::KERATIN_ISA
