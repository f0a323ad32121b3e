// What detection, the impulse pass and the Gauss-Seidel solve share: the strands as edges in space,
// the contacts between them, and how a contact reads velocities and gives impulses
// (METHODS 2.5, 2.6).
#pragma once

#include "runtime/shape/moving_shape.h"
#include "runtime/shape/vector3.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// The strands of one time step as chains of edges. Vertices of a strand follow each other, and so
// do its edges; edge e joins first_vertex[e] and first_vertex[e] + 1.
struct ContactStrands {
    std::span<const Vector3> x_t0;  // [vertex_count] m, start of the step
    std::span<const Vector3> x_t1;  // [vertex_count] m, end of the step by the present velocities
    std::span<const std::uint32_t> first_vertex;  // [edge_count]
    std::span<const std::uint32_t> strand;        // [edge_count], ascending
    std::span<const double> radius;               // [edge_count] m
    std::span<const std::uint8_t> prescribed;     // [vertex_count] 1: the vertex moves as told
    std::size_t vertex_count() const { return x_t0.size(); }
    std::size_t edge_count() const { return first_vertex.size(); }
};

// Which place of which pair a contact is: the same key names the same contact in every detection of
// a step and in the next step.
struct ContactKey {
    std::uint64_t pair = 0;  // edge 1 << 32 | edge 2, or edge << 32 | kAgainstCollider | collider
    std::uint32_t feature =
        0;  // bit 0 / 1: at the start vertex of edge 1 / 2; above: element of a mesh or box
    friend auto operator<=>(const ContactKey&, const ContactKey&) = default;
};
constexpr std::uint32_t kAgainstCollider = 0x80000000u;

// One contact point. Side 0 is a strand; side 1 another strand or a collider.
struct Contact {
    ContactKey key;
    std::uint32_t edge[2] = {0, 0};  // edge[1]: collider index when against_collider
    bool against_collider = false;
    double parameter[2] = {0, 0};  // position on the edges, 0..1
    Vector3 normal{0, 1, 0};       // unit, from side 1 to side 0, at the first moment of contact
    Vector3 arm[2] = {
        Vector3(0),
        Vector3(0)};      // m, from the point on each centre line to the common point, at x_t
    double gap = 0;       // m, N.(p_0 - p_1)(x_t) - distance, with its bound (METHODS 2.7)
    double distance = 0;  // m, delta
    double friction = 0;
    Vector3 obstacle_velocity{0, 0, 0};  // m/s, of the collider's point
    Vector3 impulse{0, 0, 0};            // N s, on side 0; world axes
};

// Where the numbers of a velocity vector lie: component c of vertex i at vertex[i] + c * stride,
// the spin of edge e at edge[e]. Serves interleaved lanes and plain arrays alike.
struct VelocityLayout {
    std::span<const std::uint32_t> vertex;  // [vertex_count]
    std::span<const std::uint32_t> edge;    // [edge_count]
    std::uint32_t stride = 1;
};

// One side of a contact against its edge: everything that reading a velocity needs.
struct ContactSide {
    std::uint32_t vertex_a, vertex_b, spin;  // indices into the velocity vector
    double weight_a, weight_b;               // 1 - alpha, alpha
    Vector3 arm;                             // m
    Vector3 tangent;                         // unit, at x_t
    double inverse_length;                   // 1/m
};

inline ContactSide make_side(const ContactStrands& strands, const VelocityLayout& layout,
                             std::uint32_t edge, double parameter, const Vector3& arm) {
    const std::uint32_t v = strands.first_vertex[edge];
    const Vector3 e = strands.x_t0[v + 1] - strands.x_t0[v];
    const double l = length(e);
    const double inverse = l > 0 ? 1 / l : 0;
    return {layout.vertex[v],  layout.vertex[v + 1],
            layout.edge[edge], 1 - parameter,
            parameter,         arm,
            e * inverse,       inverse};
}

inline Vector3 read_velocity(std::span<const double> v, std::uint32_t base, std::uint32_t stride) {
    return {v[base], v[base + stride], v[base + 2 * stride]};
}

// Velocity of the edge's material at the common point c: that of the point on the centre line plus
// omega x (c - p), omega = t x (v_b - v_a) / |e| + spin t.
inline Vector3 side_velocity(const ContactSide& s, std::span<const double> v,
                             std::uint32_t stride) {
    const Vector3 va = read_velocity(v, s.vertex_a, stride),
                  vb = read_velocity(v, s.vertex_b, stride);
    const Vector3 w = (vb - va) * s.inverse_length;
    const Vector3 across = cross(s.tangent, s.arm);
    return s.weight_a * va + s.weight_b * vb + w * dot(s.tangent, s.arm) -
           s.tangent * dot(w, s.arm) + v[s.spin] * across;
}

// What the impulse r at the common point does to the edge: the transpose of side_velocity.
struct SideImpulse {
    Vector3 on_a, on_b;
    double on_spin;
};
inline SideImpulse side_impulse(const ContactSide& s, const Vector3& r) {
    const Vector3 couple = cross(s.arm, r);
    const Vector3 f = cross(couple, s.tangent) * s.inverse_length;
    return {s.weight_a * r - f, s.weight_b * r + f, dot(couple, s.tangent)};
}

// Fills arm, gap and obstacle_velocity of a contact whose key, edges, parameters, normal and
// distance are known. surface_t0, surface_t1: the collider's material point at start and end of the
// step (strand on strand: not used). start_distance: m, between the two centre lines, or to the
// surface, at x_t; when that is less than 0.8 delta the gap is bounded so that the push out of each
// other takes several steps: 0.2 delta a step or, against colliders, what removes the depth in 0.05
// s.
void place_contact(const ContactStrands& strands, double step, double start_distance,
                   const Vector3& surface_t0, const Vector3& surface_t1, Contact& contact);

}  // namespace keratin
