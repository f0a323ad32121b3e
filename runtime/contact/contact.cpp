#include "runtime/contact/contact.h"

#include <algorithm>

namespace keratin {

SideRows make_rows(const ContactStrands& strands, const Contact& contact, int side,
                   const ContactFrame& frame, std::uint32_t first, std::uint32_t stride) {
    const std::uint32_t v = strands.first_vertex[contact.edge[side]];
    const Vector3 e = strands.x_t0[v + 1] - strands.x_t0[v];
    const double l = length(e), inverse = l > 0 ? 1 / l : 0;
    const Vector3 t = e * inverse;
    const Vector3& arm = contact.arm[side];
    const double alpha = contact.parameter[side], sign = side == 0 ? 1 : -1;
    SideRows rows;
    rows.first = first;
    rows.stride = stride;
    for (int k = 0; k < 3; ++k) {
        // The transpose: a unit impulse along the axis, and its couple about the centre line
        // carried by opposite impulses on the end points and by the spin.
        const Vector3 r = sign * frame.axis[k];
        const Vector3 couple = cross(arm, r);
        const Vector3 f = cross(couple, t) * inverse;
        const Vector3 a = (1 - alpha) * r - f, b = alpha * r + f;
        const double weight[7] = {a.x, a.y, a.z, dot(couple, t), b.x, b.y, b.z};
        for (int i = 0; i < 7; ++i) rows.weight[k][i] = weight[i];
    }
    return rows;
}

void place_contact(const ContactStrands& strands, double step, double start_distance,
                   const Vector3& surface_t0, const Vector3& surface_t1, Contact& contact) {
    constexpr double kPushOut = 0.2;       // of delta, a step
    constexpr double kPushOutTime = 0.05;  // s
    constexpr double kAside = 0.1;         // of the shorter edge
    auto point = [&](int side) {
        const std::uint32_t v = strands.first_vertex[contact.edge[side]];
        return mix(strands.x_t0[v], strands.x_t0[v + 1], contact.parameter[side]);
    };
    auto length_of = [&](int side) {
        const std::uint32_t v = strands.first_vertex[contact.edge[side]];
        return length(strands.x_t0[v + 1] - strands.x_t0[v]);
    };
    const Vector3 p0 = point(0);
    double allowed = kPushOut * contact.distance;
    contact.eased = 0;
    if (contact.against_collider) {
        contact.gap = dot(contact.normal, p0 - surface_t0) - contact.distance;
        contact.arm[0] =
            Vector3(0);  // METHODS 2.5: the force acts on the centre line, nothing rolls
        contact.arm[1] = Vector3(0);
        contact.obstacle_velocity = (surface_t1 - surface_t0) * (1 / step);
        allowed = std::max(
            allowed, (contact.distance - start_distance) * std::min(1.0, step / kPushOutTime));
    } else {
        Vector3 between = p0 - point(1);
        const double r0 = strands.radius[contact.edge[0]], r1 = strands.radius[contact.edge[1]];
        contact.gap = dot(contact.normal, between) - contact.distance;
        // METHODS 2.6 has the common point between the points at x_t. Where these still lie far
        // aside of each other, as at 4 m/s in 1 ms, such arms would couple the normal velocity to
        // the edges' turning, of which the distance knows nothing, and throw the strands about: the
        // arms are then those of the moment of contact, and the momentum about x_t is not kept.
        const Vector3 aside = between - dot(contact.normal, between) * contact.normal;
        const double shorter = std::min(length_of(0), length_of(1));
        if (length(aside) > kAside * shorter) between = contact.distance * contact.normal;
        contact.arm[0] = -(r0 / (r0 + r1)) * between;
        contact.arm[1] = (r1 / (r0 + r1)) * between;
    }
    if (contact.distance - start_distance > kPushOut * contact.distance)
        contact.gap = std::max(contact.gap, -allowed);
}

}  // namespace keratin
