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
    std::uint32_t feature = 0;  // bit 0 / 1: at the start vertex of edge 1 / 2; above: element of a
                                // mesh or box, or the part of edge 1
    friend auto operator<=>(const ContactKey&, const ContactKey&) = default;
};
constexpr std::uint32_t kAgainstCollider = 0x80000000u;

// One contact point. Side 0 is a strand; side 1 another strand or a collider.
struct Contact {
    ContactKey key;
    std::uint32_t edge[2] = {0, 0};  // edge[1]: collider index when against_collider
    bool against_collider = false;
    double parameter[2] = {0, 0};  // position on the edges, 0..1
    bool by_place = false;  // inside edge 1 on a round solid: known by its place, not its key alone
    Vector3 normal{0, 1, 0};       // unit, from side 1 to side 0, at the first moment of contact
    Vector3 arm[2] = {
        Vector3(0),
        Vector3(0)};       // m, from the point on each centre line to the common point, at x_t
    double gap = 0;        // m, N.(p_0 - p_1)(x_t) - distance, with its bound (METHODS 2.7)
    double distance = 0;   // m, delta
    double eased = 0;      // m, the part of the gap by which it was made to suit other contacts
    bool fresh = false;    // added by the last merge_contacts
    double shortfall = 0;  // m, > 0: what the end of the step lacks (refresh_contacts)
    std::uint32_t renewals = 0;  // how often it was taken anew in this step
    double friction = 0;
    Vector3 obstacle_velocity{0, 0, 0};  // m/s, of the collider's point
    Vector3 impulse{0, 0, 0};            // N s, on side 0; world axes
    Vector3 applied{0, 0, 0};            // N s, the part of it that the velocity contains already
};

// Where a contact is on the centre line of a side's edge at the start of the step.
inline Vector3 place_of(const ContactStrands& strands, const Contact& contact, int side) {
    const std::uint32_t v = strands.first_vertex[contact.edge[side]];
    return mix(strands.x_t0[v], strands.x_t0[v + 1], contact.parameter[side]);
}

// One side of a contact as rows of H (METHODS 2.6): the velocity of the edge's material at the
// common point along normal, first and second tangent, from the seven numbers of its edge, which
// stand `stride` apart: vertex a (3), spin, vertex b (3). On side 1 the sign is turned, so that the
// sum of both sides is the relative velocity u; the transpose gives the impulse H^T r.
struct SideRows {
    std::uint32_t first = 0;  // where the number a.x stands in a vector of all numbers
    std::uint32_t stride = 1;
    double weight[3][7] = {};
};

// Two unit tangents that make a right-handed frame with the unit normal.
struct ContactFrame {
    Vector3 axis[3];  // normal, first, second tangent
};
inline ContactFrame contact_frame(const Vector3& normal) {
    const Vector3 t = any_perpendicular(normal);
    return {{normal, t, cross(normal, t)}};
}

// Rows of one side: the point on the centre line moves with (1 - alpha) v_a + alpha v_b, and the
// common point with omega x arm besides, omega = t x (v_b - v_a) / |e| + spin t.
SideRows make_rows(const ContactStrands& strands, const Contact& contact, int side,
                   const ContactFrame& frame, std::uint32_t first, std::uint32_t stride);

// Adds what the side reads from the velocities v to u [3].
inline void add_velocity(const SideRows& rows, std::span<const double> v, double* u) {
    for (int k = 0; k < 3; ++k) {
        double sum = 0;
        for (int i = 0; i < 7; ++i)
            sum += rows.weight[k][i] * v[rows.first + static_cast<std::size_t>(i) * rows.stride];
        u[k] += sum;
    }
}

// Adds the impulse r [3] (contact frame) to the vector of all numbers.
inline void add_impulse(const SideRows& rows, const double* r, std::span<double> impulse) {
    for (int i = 0; i < 7; ++i)
        impulse[rows.first + static_cast<std::size_t>(i) * rows.stride] +=
            rows.weight[0][i] * r[0] + rows.weight[1][i] * r[1] + rows.weight[2][i] * r[2];
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
