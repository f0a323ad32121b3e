// Every formula of schema/bend.h, schema/formula, runtime/formula and runtime/shape as a function
// from a list of numbers to a list of numbers, so that scalars, lanes and double can be compared on
// the same inputs.
#pragma once

#include "runtime/formula/bend.h"
#include "runtime/formula/contact.h"
#include "runtime/formula/grid.h"
#include "runtime/formula/interpolate.h"
#include "runtime/formula/length.h"
#include "runtime/formula/verlet.h"
#include "runtime/formula/wind.h"
#include "runtime/shape/distance.h"
#include "schema/formula/barycentric.h"
#include "schema/formula/frame.h"
#include "schema/formula/interpolation.h"
#include "schema/formula/quaternion.h"

namespace keratin::agree {

inline constexpr int kInputs = 16, kOutputs = 4;

// X(name, statements): the statements read v(i), n(i) (unit vectors), q(i) (unit quaternions) and
// s(i) (numbers), and call out(...).
#define KERATIN_FORMULAS(X)                                                                        \
    X(normalize_or, out(normalize_or(v(0), v(1))))                                                 \
    X(any_perpendicular, out(any_perpendicular(n(0))))                                             \
    X(product, out(product(q(0), q(1))))                                                           \
    X(rotate, out(rotate(q(0), v(2))))                                                             \
    X(nlerp, out(nlerp(q(0), q(1), abs(s(12)))))                                                   \
    X(quaternion_of_columns, out(quaternion_of_columns(rotate(q(0), x_axis), rotate(q(0), y_axis), \
                                                       rotate(q(0), z_axis))))                     \
    X(minimal_rotation, out(minimal_rotation(n(0), n(1), any_perpendicular(n(0)), v(2))))          \
    X(transport_director, out(transport_director(n(0), n(1), any_perpendicular(n(0)))))            \
    X(to_frame, out(to_frame(n(0), any_perpendicular(n(0)), v(2))))                                \
    X(from_frame, out(from_frame(n(0), any_perpendicular(n(0)), v(2))))                            \
    X(barycentric_point, out(barycentric_point(v(0), v(1), v(2), s(12), s(13))))                   \
    X(triangle_rotation, out(triangle_rotation(v(0), v(1), v(2))))                                 \
    X(mix_points, out(mix_points(v(0), v(1), s(12))))                                              \
    X(verlet_move, out(verlet_move(v(0), v(1), s(12), v(2), s(13))))                               \
    X(bend_inverse, out(bend_inverse(n(0), n(1))))                                                 \
    X(bend_target, out(bend_target(n(0), n(1), v(2), s(12), s(13))))                               \
    X(bend_reaction, out(bend_reaction(n(0), n(1), v(2), v(3), s(12), s(13), s(14))))              \
    X(joint_stiffness, out(joint_stiffness(abs(s(12)), abs(s(13)), number(1) + abs(s(14)))))       \
    X(bend_stiffness, out(bend_stiffness(abs(s(12)), abs(s(13)), abs(s(14)))))                     \
    X(stiffest_joint, out(stiffest_joint(s(12))))                                                  \
    X(carried_weight, out(carried_weight(abs(s(12)), abs(s(13)), abs(s(14)))))                     \
    X(filled_share, out(filled_share(abs(s(12)), s(13))))                                          \
    X(own_part, out(own_part(s(12))))                                                              \
    X(longest_turn, out(longest_turn(s(12))))                                                      \
    X(resolved_move, out(resolved_move(v(0), v(1), abs(s(12)))))                                   \
    X(bend_pull, out(bend_pull(abs(s(12)), s(13), abs(s(14)))))                                    \
    X(weight_stiffness, out(weight_stiffness(s(12), abs(s(13)), abs(s(14)))))                      \
    X(bend_lever, out(bend_lever(v(0), v(1))))                                                     \
    X(minimal_turn, out(minimal_turn(n(0), n(1), v(2))))                                           \
    X(bend_sweep, out(bend_sweep(v(0), v(1))))                                                     \
    X(inverse_point_mass, out(inverse_point_mass(abs(s(12)), abs(s(13)))))                         \
    X(pull_to_parent, out(pull_to_parent(v(0), abs(s(12)))))                                       \
    X(way_out, out(way_out(n(0), abs(s(12)), n(1), abs(s(13)))))                                   \
    X(plane_room, out(plane_room(n(0), abs(s(12)), n(1), abs(s(13)))))                             \
    X(turned_along, out(turned_along(n(0), number(1) + abs(s(12)), n(1), v(2))))                   \
    X(friction_move, out(friction_move(v(0), n(1), s(12), abs(s(13)))))                            \
    X(volume_acceleration, out(volume_acceleration(s(14), s(15), v(0), s(12), abs(s(13)))))        \
    X(rubbed, out(rubbed(v(0), v(1), s(12))))                                                      \
    X(floor_of, out(floor_of(s(12) * number(37.5))))                                               \
    X(wave_at, out(wave_at(v(0), v(1), s(12))))                                                    \
    X(wind_acceleration, out(wind_acceleration(v(0), v(1), abs(s(12)), abs(s(13)))))               \
    X(carried, out(carried(q(0), v(2), v(3))))                                                     \
    X(weighted_displacement, out(weighted_displacement(v(0), v(1), v(2), s(12), s(13), s(14))))    \
    X(capsule_distance,                                                                            \
      out4(capsule_distance(v(0), v(1), v(2), number(1) / dot(v(2), v(2)), abs(s(12)), normal)))   \
    X(capsule_square, out(capsule_square(v(0), v(1), v(2), number(1) / dot(v(2), v(2)))))          \
    X(plane_distance, out4(plane_distance(v(0), v(1), n(2), normal)))                              \
    X(box_distance, out4(box_distance(v(0), vector(abs(s(12)), abs(s(13)), abs(s(14))), normal)))

enum Formula {
#define X(name, statements) formula_##name,
    KERATIN_FORMULAS(X)
#undef X
        formula_count
};

inline const char* name_of(int formula) {
    static const char* const names[] = {
#define X(name, statements) #name,
        KERATIN_FORMULAS(X)
#undef X
    };
    return names[formula];
}

// Internal linkage: instruction sets must not share code.
template <class Real>
static void evaluate(int formula, const Real* in, Real* result) {
    using V = Vec3<Real>;
    using Q = Vec4<Real>;
    const auto number = [](double x) { return Real(float(x)); };
    const auto vector = [](Real x, Real y, Real z) { return V(x, y, z); };
    const V x_axis(number(1), number(0), number(0)), y_axis(number(0), number(1), number(0)),
        z_axis(number(0), number(0), number(1));
    const auto s = [&](int i) { return in[i]; };
    const auto v = [&](int i) { return V(in[3 * i], in[3 * i + 1], in[3 * i + 2]); };
    const auto n = [&](int i) { return normalize_or(v(i), z_axis); };
    const auto q = [&](int i) {
        return unit_quaternion(Q(in[4 * i], in[4 * i + 1], in[4 * i + 2], in[4 * i + 3]));
    };
    V normal = z_axis;
    for (int i = 0; i < kOutputs; ++i) result[i] = number(0);
    struct Out {
        Real* r;
        void operator()(const Real& a) const { r[0] = a; }
        void operator()(const V& a) const { r[0] = a.x, r[1] = a.y, r[2] = a.z; }
        void operator()(const Q& a) const { r[0] = a.x, r[1] = a.y, r[2] = a.z, r[3] = a.w; }
    } out{result};
    const auto out4 = [&](const Real& distance) {
        out(normal);
        result[3] = distance;
    };
    (void)out4, (void)vector;
    switch (formula) {
#define X(name, statements) \
    case formula_##name:    \
        statements;         \
        break;
        KERATIN_FORMULAS(X)
#undef X
        default:
            break;
    }
}

}  // namespace keratin::agree
