#include "runtime/contact/contact.h"

#include <algorithm>

namespace keratin {

void place_contact(const ContactStrands& strands, double step, double start_distance,
                   const Vector3& surface_t0, const Vector3& surface_t1, Contact& contact) {
    constexpr double kPushOut = 0.2;       // of delta, a step
    constexpr double kPushOutTime = 0.05;  // s
    auto point = [&](int side) {
        const std::uint32_t v = strands.first_vertex[contact.edge[side]];
        return mix(strands.x_t0[v], strands.x_t0[v + 1], contact.parameter[side]);
    };
    const Vector3 p0 = point(0);
    double allowed = kPushOut * contact.distance;
    if (contact.against_collider) {
        contact.gap = dot(contact.normal, p0 - surface_t0) - contact.distance;
        contact.arm[0] =
            Vector3(0);  // METHODS 2.5: the force acts on the centre line, nothing rolls
        contact.arm[1] = Vector3(0);
        contact.obstacle_velocity = (surface_t1 - surface_t0) * (1 / step);
        allowed = std::max(
            allowed, (contact.distance - start_distance) * std::min(1.0, step / kPushOutTime));
    } else {
        const Vector3 between = p0 - point(1);
        const double r0 = strands.radius[contact.edge[0]], r1 = strands.radius[contact.edge[1]];
        contact.gap = dot(contact.normal, between) - contact.distance;
        contact.arm[0] = -(r0 / (r0 + r1)) * between;
        contact.arm[1] = (r1 / (r0 + r1)) * between;
    }
    if (contact.distance - start_distance > kPushOut * contact.distance)
        contact.gap = std::max(contact.gap, -allowed);
}

}  // namespace keratin
