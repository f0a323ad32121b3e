// Discrete elastic rods (METHODS §2.1, 2.2): geometry of an edge and of a joint, and the stretch,
// bend and twist energies with their gradients and Hessians side by side. Real is a double or a lane
// pack; everything is branch-free.
//
// A joint lies between the edge e = e^{i-1} (tangent t) and the edge f = e^i (tangent u). Its local
// numbers are 0..2 x_{i-1}, 3 theta^{i-1}, 4..6 x_i, 7 theta^i, 8..10 x_{i+1}.
//
// Viscosity needs no terms of its own: with stiffness k, rest value r, viscous stiffness d and
// start-of-step value s, k(x - r)^2 + d(x - s)^2 = (k + d)(x - (k r + d s)/(k + d))^2 + constant.
#pragma once

#include "runtime/lane/trigonometry.h"
#include "runtime/lane/vector3.h"

namespace keratin {

// Below this 1 + t.u the minimal rotation from t to u is replaced by the half turn about the first
// director (METHODS, head of the page).
inline constexpr double kFoldLimit = 1e-7;
// 1 + t.u is kept above this in the curvature (METHODS §2.2, curvature).
inline constexpr double kFoldFloor = 1e-12;

template <class Real>
struct EdgeGeometry {
    Vector3<Real> tangent;
    Real length;          // m
    Real inverse_length;  // 1/m
};

template <class Real>
KERATIN_LANE_INLINE EdgeGeometry<Real> edge_geometry(const Vector3<Real>& edge) {
    // the floor keeps an edge that has shrunk to nothing finite: its tangent is 0 then
    const Real square = max(dot(edge, edge), Real(1e-60));
    const Real length = sqrt(square);
    const Real inverse = Real(1.0) / length;
    return {inverse * edge, length, inverse};
}

// The director a, perpendicular to `from`, carried by the minimal rotation from -> to; exactly
// perpendicular to `to`, of unit length to the rounding of its sums. cosine: from.to; inverse: 1
// over 1 + cosine, any number where that is less than kFoldLimit.
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> carry_director(const Vector3<Real>& from, const Vector3<Real>& to,
                                                 const Vector3<Real>& a, const Real& cosine,
                                                 const Real& inverse) {
    const Vector3<Real> k = cross(from, to);
    const Vector3<Real> turned = mul_add(cosine, a, mul_add(dot(k, a) * inverse, k, cross(k, a)));
    const Vector3<Real> b = select(Real(1.0) + cosine < Real(kFoldLimit), a, turned);
    return mul_add(-dot(b, to), to, b);
}
// The same, of unit length.
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> transport(const Vector3<Real>& from, const Vector3<Real>& to,
                                            const Vector3<Real>& a) {
    const Real cosine = dot(from, to);
    const Real inverse = Real(1.0) / max(Real(1.0) + cosine, Real(kFoldLimit));
    const Vector3<Real> b = carry_director(from, to, a, cosine, inverse);
    return (Real(1.0) / sqrt(max(dot(b, b), Real(1e-60)))) * b;
}
// b, whose length is 1 to 1e-6 (or 0), with a length that is 1 to 1e-12: no root, no division.
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> near_unit(const Vector3<Real>& b) {
    return sub_mul(Real(1.5), Real(0.5), dot(b, b)) * b;
}

// Angle about `axis` from a to b, both unit and perpendicular to it, plus the multiple of 2 pi that
// brings it nearest to `last`.
template <class Real>
KERATIN_LANE_INLINE Real turn_near(const Vector3<Real>& a, const Vector3<Real>& b,
                                   const Vector3<Real>& axis, const Real& last) {
    const Real angle = angle_of(dot(cross(a, b), axis), dot(a, b));
    const Real turns = round((last - angle) * Real(0.15915494309189535));
    return mul_add(turns, Real(6.283185307179586), angle);
}

// Material directors m_1, m_2 of an edge from its reference director and angle.
template <class Real>
struct Directors {
    Vector3<Real> m1, m2;
};
template <class Real>
KERATIN_LANE_INLINE Directors<Real> material_directors(const Vector3<Real>& tangent,
                                                       const Vector3<Real>& reference,
                                                       const Real& angle) {
    Real sine, cosine;
    sin_cos(angle, sine, cosine);
    const Vector3<Real> side = cross(tangent, reference);
    return {mul_add(cosine, reference, sine * side), mul_add(-sine, reference, cosine * side)};
}

// ---- stretch (2.1): 1/2 k (|e| - rest)^2 with k = EA/|e_rest| ------------------------------------

template <class Real>
KERATIN_LANE_INLINE Real stretch_energy(const Real& k, const Real& rest, const Real& length) {
    const Real d = length - rest;
    return Real(0.5) * k * d * d;
}
// With respect to the edge vector.
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> stretch_gradient(const Real& k, const Real& rest,
                                                   const EdgeGeometry<Real>& e) {
    return (k * (e.length - rest)) * e.tangent;
}
// k (t t^T + (1 - rest/|e|)(1 - t t^T)) as k (along t t^T + across 1); the second part is left out
// under compression where `exact` is 0, which keeps it positive.
template <class Real>
struct StretchHessian {
    Real along, across;
};
template <class Real>
KERATIN_LANE_INLINE StretchHessian<Real> stretch_hessian(const Real& k, const Real& rest,
                                                         const EdgeGeometry<Real>& e,
                                                         const Real& exact) {
    const Real s = sub_mul(Real(1.0), rest, e.inverse_length);
    const Real across = k * select(s < Real(0.0), exact * s, s);
    return {k - across, across};
}

// ---- joint: curvature (2.4 with its erratum), bend (2.5, 2.6) and twist (2.7) --------------------

template <class Real>
struct Joint {
    Vector3<Real> t, u;                // tangents before and after
    Real inverse_e, inverse_f;         // 1/m
    Real inverse_chi;                  // chi = 1 + t.u
    Vector3<Real> kb;                  // curvature binormal, 2 t x u / chi
    Directors<Real> before, after;     // material directors of both edges
    Real w1_before, w2_before;         // omega^{i-1}: (kb.m_2, -kb.m_1)
    Real w1_after, w2_after;           // omega^i
};

// chi of t.u.
template <class Real>
KERATIN_LANE_INLINE Real fold_floored(const Real& cosine) {
    return max(Real(1.0) + cosine, Real(kFoldFloor));
}
// inverse_chi: 1 over fold_floored(t.u).
template <class Real>
KERATIN_LANE_INLINE Joint<Real> make_joint(const Vector3<Real>& t, const Real& inverse_e,
                                           const Directors<Real>& before, const Vector3<Real>& u,
                                           const Real& inverse_f, const Directors<Real>& after,
                                           const Real& inverse_chi) {
    Joint<Real> j;
    j.t = t;
    j.u = u;
    j.inverse_e = inverse_e;
    j.inverse_f = inverse_f;
    j.inverse_chi = inverse_chi;
    j.kb = (Real(2.0) * j.inverse_chi) * cross(t, u);
    j.before = before;
    j.after = after;
    j.w1_before = dot(j.kb, before.m2);
    j.w2_before = -dot(j.kb, before.m1);
    j.w1_after = dot(j.kb, after.m2);
    j.w2_after = -dot(j.kb, after.m1);
    return j;
}
template <class Real>
KERATIN_LANE_INLINE Joint<Real> make_joint(const Vector3<Real>& t, const Real& inverse_e,
                                           const Directors<Real>& before, const Vector3<Real>& u,
                                           const Real& inverse_f, const Directors<Real>& after) {
    return make_joint(t, inverse_e, before, u, inverse_f, after,
                      Real(1.0) / fold_floored(dot(t, u)));
}

// Stiffness and rest values of a joint: k1 = B_1/(2 l), k2 = B_2/(2 l), kt = GJ/l with l the Voronoi
// length; rest omega of both edges and rest twist.
template <class Real>
struct JointMaterial {
    Real k1, k2, kt;
    Real rest1_before, rest2_before, rest1_after, rest2_after, rest_twist;
};

// twist = theta^i - theta^{i-1} + reference twist
template <class Real>
KERATIN_LANE_INLINE Real bend_energy(const JointMaterial<Real>& m, const Joint<Real>& j) {
    const Real a = j.w1_before - m.rest1_before, b = j.w1_after - m.rest1_after;
    const Real c = j.w2_before - m.rest2_before, d = j.w2_after - m.rest2_after;
    return Real(0.5) *
           mul_add(m.k1, mul_add(a, a, b * b), m.k2 * mul_add(c, c, d * d));
}
template <class Real>
KERATIN_LANE_INLINE Real twist_energy(const JointMaterial<Real>& m, const Real& twist) {
    const Real d = twist - m.rest_twist;
    return Real(0.5) * m.kt * d * d;
}

template <class Real>
struct JointGradient {
    Vector3<Real> e, f;  // with respect to the edge vectors
    Real before, after;  // with respect to theta^{i-1}, theta^i
};

// The sum of the bend terms' moments: g_k = k_k (omega_k - rest_k) on each edge, and M = sum of
// g_1 m_2 - g_2 m_1.
template <class Real>
struct BendMoment {
    Real g1_before, g2_before, g1_after, g2_after;
    Vector3<Real> before, after;
};
template <class Real>
KERATIN_LANE_INLINE BendMoment<Real> bend_moment(const JointMaterial<Real>& m,
                                                 const Joint<Real>& j) {
    BendMoment<Real> s;
    s.g1_before = m.k1 * (j.w1_before - m.rest1_before);
    s.g2_before = m.k2 * (j.w2_before - m.rest2_before);
    s.g1_after = m.k1 * (j.w1_after - m.rest1_after);
    s.g2_after = m.k2 * (j.w2_after - m.rest2_after);
    s.before = mul_add(s.g1_before, j.before.m2, -s.g2_before * j.before.m1);
    s.after = mul_add(s.g1_after, j.after.m2, -s.g2_after * j.after.m1);
    return s;
}

// |e| times the derivative of kb.m with respect to e, m held: -(kb.m) t~ + 2 u x m / chi with
// t~ = (t + u)/chi; and |f| times the one with respect to f: -(kb.m) t~ - 2 t x m / chi.
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> curvature_gradient_e(const Joint<Real>& j, const Vector3<Real>& m,
                                                       const Real& kb_m) {
    const Vector3<Real> v = mul_add(-kb_m, j.t + j.u, Real(2.0) * cross(j.u, m));
    return j.inverse_chi * v;
}
template <class Real>
KERATIN_LANE_INLINE Vector3<Real> curvature_gradient_f(const Joint<Real>& j, const Vector3<Real>& m,
                                                       const Real& kb_m) {
    const Vector3<Real> v = mul_add(-kb_m, j.t + j.u, Real(2.0) * cross(m, j.t));
    return j.inverse_chi * v;
}

// Bend and twist together.
template <class Real>
KERATIN_LANE_INLINE JointGradient<Real> joint_gradient(const JointMaterial<Real>& m,
                                                       const Joint<Real>& j, const Real& twist) {
    const BendMoment<Real> s = bend_moment(m, j);
    const Vector3<Real> moment = s.before + s.after;
    const Real kb_m = dot(j.kb, moment);
    const Real torque = m.kt * (twist - m.rest_twist);
    const Vector3<Real> half = (Real(0.5) * torque) * j.kb;  // torque times d mbar/d(e/|e|)
    JointGradient<Real> g;
    g.e = j.inverse_e * (curvature_gradient_e(j, moment, kb_m) + half);
    g.f = j.inverse_f * (curvature_gradient_f(j, moment, kb_m) + half);
    g.before = mul_add(s.g1_before, j.w2_before, -s.g2_before * j.w1_before) - torque;
    g.after = mul_add(s.g1_after, j.w2_after, -s.g2_after * j.w1_after) + torque;
    return g;
}

template <class Real>
struct Matrix3 {
    Real xx, xy, xz, yx, yy, yz, zx, zy, zz;
};
template <class Real>
struct Symmetric3 {
    Real xx, xy, xz, yy, yz, zz;
};

// m += s (a b^T + b a^T)
template <class Real>
KERATIN_LANE_INLINE void add_pair(Symmetric3<Real>& m, const Real& s, const Vector3<Real>& a,
                                  const Vector3<Real>& b) {
    const Vector3<Real> c = s * b;
    m.xx = mul_add(Real(2.0) * a.x, c.x, m.xx);
    m.yy = mul_add(Real(2.0) * a.y, c.y, m.yy);
    m.zz = mul_add(Real(2.0) * a.z, c.z, m.zz);
    m.xy = mul_add(a.x, c.y, mul_add(c.x, a.y, m.xy));
    m.xz = mul_add(a.x, c.z, mul_add(c.x, a.z, m.xz));
    m.yz = mul_add(a.y, c.z, mul_add(c.y, a.z, m.yz));
}
// m += s a a^T
template <class Real>
KERATIN_LANE_INLINE void add_square(Symmetric3<Real>& m, const Real& s, const Vector3<Real>& a) {
    const Vector3<Real> c = s * a;
    m.xx = mul_add(a.x, c.x, m.xx);
    m.yy = mul_add(a.y, c.y, m.yy);
    m.zz = mul_add(a.z, c.z, m.zz);
    m.xy = mul_add(a.x, c.y, m.xy);
    m.xz = mul_add(a.x, c.z, m.xz);
    m.yz = mul_add(a.y, c.z, m.yz);
}
template <class Real>
KERATIN_LANE_INLINE void add_identity(Symmetric3<Real>& m, const Real& s) {
    m.xx = m.xx + s;
    m.yy = m.yy + s;
    m.zz = m.zz + s;
}
// m += s a b^T
template <class Real>
KERATIN_LANE_INLINE void add_outer(Matrix3<Real>& m, const Real& s, const Vector3<Real>& a,
                                   const Vector3<Real>& b) {
    const Vector3<Real> c = s * a;
    m.xx = mul_add(c.x, b.x, m.xx);
    m.xy = mul_add(c.x, b.y, m.xy);
    m.xz = mul_add(c.x, b.z, m.xz);
    m.yx = mul_add(c.y, b.x, m.yx);
    m.yy = mul_add(c.y, b.y, m.yy);
    m.yz = mul_add(c.y, b.z, m.yz);
    m.zx = mul_add(c.z, b.x, m.zx);
    m.zy = mul_add(c.z, b.y, m.zy);
    m.zz = mul_add(c.z, b.z, m.zz);
}
// m += [a]x, the matrix of the cross product with a
template <class Real>
KERATIN_LANE_INLINE void add_cross(Matrix3<Real>& m, const Vector3<Real>& a) {
    m.xy = m.xy - a.z;
    m.xz = m.xz + a.y;
    m.yx = m.yx + a.z;
    m.yz = m.yz - a.x;
    m.zx = m.zx - a.y;
    m.zy = m.zy + a.x;
}

// Second derivatives of bend and twist with respect to the edge vectors and the two angles.
template <class Real>
struct JointHessian {
    Symmetric3<Real> ee, ff;
    Matrix3<Real> ef;  // row e, column f
    Vector3<Real> e_before, f_before, e_after, f_after;
    Real before_before, before_after, after_after;  // theta^{i-1}, theta^i
};

// The symmetric part of the gradient's derivative, exact where the frames are based. `exact` 1: all of
// it; 0: without the second derivatives of curvature and reference twist, which leaves a positive
// semidefinite matrix.
//
// With A = |e| d(kb.m)/de, A' = |f| d(kb.m)/df, S = kb.m, t~ = (t + u)/chi (m the moment of bend_moment):
//   |e|^2   d^2(kb.m)/de^2  = -(t~ A^T + A t~^T) - S/chi (1 - t t^T) + sym(kb m^T)   if m is of edge e
//   |f|^2   d^2(kb.m)/df^2  = -(t~ A'^T + A' t~^T) - S/chi (1 - u u^T) + sym(kb m^T) if m is of edge f
//   |e||f|  d^2(kb.m)/de df = -t~ A'^T - A t~^T - S/chi (1 + t u^T) - 2/chi [m]x
//   |e|^2   d^2 mbar/de^2   = -1/4 (kb (t~ + t)^T + (t~ + t) kb^T), and with u, f alike
//   |e||f|  d^2 mbar/de df  = 1/2 ([t~]x - 1/2 (kb t~^T + t~ kb^T))
template <class Real>
KERATIN_LANE_INLINE JointHessian<Real> joint_hessian(const JointMaterial<Real>& m,
                                                     const Joint<Real>& j, const Real& twist,
                                                     const Real& exact) {
    const Real zero(0.0), half(0.5);
    JointHessian<Real> h;
    h.ee = {zero, zero, zero, zero, zero, zero};
    h.ff = h.ee;
    h.ef = {zero, zero, zero, zero, zero, zero, zero, zero, zero};

    // first derivatives of the four omegas, times the edge's length
    const Vector3<Real> e1b = curvature_gradient_e(j, j.before.m2, j.w1_before);
    const Vector3<Real> e2b = -curvature_gradient_e(j, j.before.m1, -j.w2_before);
    const Vector3<Real> e1a = curvature_gradient_e(j, j.after.m2, j.w1_after);
    const Vector3<Real> e2a = -curvature_gradient_e(j, j.after.m1, -j.w2_after);
    const Vector3<Real> f1b = curvature_gradient_f(j, j.before.m2, j.w1_before);
    const Vector3<Real> f2b = -curvature_gradient_f(j, j.before.m1, -j.w2_before);
    const Vector3<Real> f1a = curvature_gradient_f(j, j.after.m2, j.w1_after);
    const Vector3<Real> f2a = -curvature_gradient_f(j, j.after.m1, -j.w2_after);
    add_square(h.ee, m.k1, e1b);
    add_square(h.ee, m.k2, e2b);
    add_square(h.ee, m.k1, e1a);
    add_square(h.ee, m.k2, e2a);
    add_square(h.ff, m.k1, f1b);
    add_square(h.ff, m.k2, f2b);
    add_square(h.ff, m.k1, f1a);
    add_square(h.ff, m.k2, f2a);
    add_outer(h.ef, m.k1, e1b, f1b);
    add_outer(h.ef, m.k2, e2b, f2b);
    add_outer(h.ef, m.k1, e1a, f1a);
    add_outer(h.ef, m.k2, e2a, f2a);
    const Real quarter_kt = Real(0.25) * m.kt;
    add_square(h.ee, quarter_kt, j.kb);
    add_square(h.ff, quarter_kt, j.kb);
    add_outer(h.ef, quarter_kt, j.kb, j.kb);

    // second derivatives, weighted with the moments
    BendMoment<Real> s = bend_moment(m, j);
    s.g1_before = exact * s.g1_before;
    s.g2_before = exact * s.g2_before;
    s.g1_after = exact * s.g1_after;
    s.g2_after = exact * s.g2_after;
    const Real torque = exact * m.kt * (twist - m.rest_twist);
    const Vector3<Real> moment_e = exact * s.before, moment_f = exact * s.after;
    const Vector3<Real> moment = moment_e + moment_f;
    const Real kb_m = dot(j.kb, moment);
    const Vector3<Real> a = curvature_gradient_e(j, moment, kb_m);
    const Vector3<Real> b = curvature_gradient_f(j, moment, kb_m);
    const Vector3<Real> tilde = j.inverse_chi * (j.t + j.u);
    const Real spread = kb_m * j.inverse_chi;
    add_pair(h.ee, Real(-1.0), tilde, a);
    add_square(h.ee, spread, j.t);
    add_identity(h.ee, -spread);
    add_pair(h.ee, half, j.kb, moment_e);
    add_pair(h.ff, Real(-1.0), tilde, b);
    add_square(h.ff, spread, j.u);
    add_identity(h.ff, -spread);
    add_pair(h.ff, half, j.kb, moment_f);
    add_outer(h.ef, Real(-1.0), tilde, b);
    add_outer(h.ef, Real(-1.0), a, tilde);
    add_outer(h.ef, -spread, j.t, j.u);
    h.ef.xx = h.ef.xx - spread;
    h.ef.yy = h.ef.yy - spread;
    h.ef.zz = h.ef.zz - spread;
    add_cross(h.ef, (Real(-2.0) * j.inverse_chi) * moment);
    const Real quarter_torque = Real(0.25) * torque;
    add_pair(h.ee, -quarter_torque, j.kb, tilde + j.t);
    add_pair(h.ff, -quarter_torque, j.kb, tilde + j.u);
    add_cross(h.ef, (half * torque) * tilde);
    add_outer(h.ef, -quarter_torque, j.kb, tilde);
    add_outer(h.ef, -quarter_torque, tilde, j.kb);

    // angles: d omega_1/d theta = omega_2, d omega_2/d theta = -omega_1
    const Vector3<Real> twist_half = (half * m.kt) * j.kb;
    const Real p1b = m.k1 * j.w2_before - s.g2_before, p2b = s.g1_before - m.k2 * j.w1_before;
    const Real p1a = m.k1 * j.w2_after - s.g2_after, p2a = s.g1_after - m.k2 * j.w1_after;
    h.e_before = mul_add(p1b, e1b, p2b * e2b) - twist_half;
    h.f_before = mul_add(p1b, f1b, p2b * f2b) - twist_half;
    h.e_after = mul_add(p1a, e1a, p2a * e2a) + twist_half;
    h.f_after = mul_add(p1a, f1a, p2a * f2a) + twist_half;
    h.before_before = mul_add(p1b, j.w2_before, -p2b * j.w1_before) + m.kt;
    h.after_after = mul_add(p1a, j.w2_after, -p2a * j.w1_after) + m.kt;
    h.before_after = -m.kt;

    const Real ee = j.inverse_e * j.inverse_e, ff = j.inverse_f * j.inverse_f;
    const Real ef = j.inverse_e * j.inverse_f;
    h.ee = {ee * h.ee.xx, ee * h.ee.xy, ee * h.ee.xz, ee * h.ee.yy, ee * h.ee.yz, ee * h.ee.zz};
    h.ff = {ff * h.ff.xx, ff * h.ff.xy, ff * h.ff.xz, ff * h.ff.yy, ff * h.ff.yz, ff * h.ff.zz};
    h.ef = {ef * h.ef.xx, ef * h.ef.xy, ef * h.ef.xz, ef * h.ef.yx, ef * h.ef.yy,
            ef * h.ef.yz, ef * h.ef.zx, ef * h.ef.zy, ef * h.ef.zz};
    h.e_before = j.inverse_e * h.e_before;
    h.e_after = j.inverse_e * h.e_after;
    h.f_before = j.inverse_f * h.f_before;
    h.f_after = j.inverse_f * h.f_after;
    return h;
}

}  // namespace keratin
