// One contact under the Coulomb law, for lane packs: its exact solution, and how far an impulse and
// a velocity are from satisfying the law. Everything in the contact's frame: normal, first and
// second tangent.
#pragma once

#include "runtime/lane/lane_double.h"

namespace keratin {

// Symmetric 3 x 3: nn n1 n2 / n1 11 12 / n2 12 22.
template <class Pack>
struct Delassus {
    Pack nn, n1, n2, t11, t12, t22;  // 1/kg
};

template <class Pack>
struct Local3 {
    Pack n, t1, t2;
};

// The impulse r with u = W r + b, W positive definite and u, r under the Coulomb law: r_N >= 0, u_N
// >= 0, r_N u_N = 0, |r_T| <= mu r_N, and r_T = -mu r_N u_T / |u_T| where u_T is not 0. b_N
// contains the gap over the step (METHODS 2.7).
//
// Take-off and sticking are linear. When slipping, u_T = -lambda r_T and u_N = 0 leave one unknown:
// (S + lambda) r_T = -c with S = W_TT - w w^T / w_nn, and |r_T| = mu r_N, the quartic of Bonnefon
// and Daviet 2011 in lambda. In the eigenvectors of S it is one scalar equation, mu r_N(lambda) /
// |r_T(lambda)| = 1, nearly linear in lambda: Newton within a bracket meets it to rounding in a few
// iterations (more where mu is large and normal and tangents are strongly coupled). It begins at
// the lambda of an impulse near the solution where there is one: `near`, or 0.
template <class Pack>
KERATIN_LANE_INLINE Local3<Pack> solve_one_contact(const Delassus<Pack>& w, const Local3<Pack>& b,
                                                   Pack mu,
                                                   const Local3<Pack>& near = {Pack(0.0), Pack(0.0),
                                                                               Pack(0.0)}) {
    constexpr int kIterations = 60;
    constexpr double kConverged = 1e-14;
    const Pack zero(0.0), one(1.0), tiny(1e-300);
    const Pack inverse_n = one / w.nn;
    const Pack s11 = w.t11 - w.n1 * w.n1 * inverse_n, s12 = w.t12 - w.n1 * w.n2 * inverse_n,
               s22 = w.t22 - w.n2 * w.n2 * inverse_n;
    const Pack c1 = b.t1 - w.n1 * b.n * inverse_n, c2 = b.t2 - w.n2 * b.n * inverse_n;

    // Eigenvectors of S: rotate by the half angle of (s11 - s22, 2 s12).
    const Pack half = Pack(0.5) * (s11 - s22), mean = Pack(0.5) * (s11 + s22);
    const Pack radius = sqrt(half * half + s12 * s12);
    const auto level = radius > tiny;
    const Pack cosine2 = select(level, half / select(level, radius, one), one);
    const Pack x = sqrt(max(Pack(0.5) * (one + cosine2), zero));
    const Pack y = copy_sign(sqrt(max(Pack(0.5) * (one - cosine2), zero)), s12);
    const Pack large = mean + radius;
    const Pack small = max(mean - radius, large * Pack(1e-14));
    const Pack ca = x * c1 + y * c2, cb = x * c2 - y * c1;
    const Pack wa = x * w.n1 + y * w.n2, wb = x * w.n2 - y * w.n1;

    // Sticking: lambda = 0.
    Pack ra = zero - ca / large, rb = zero - cb / small;
    Pack rn = zero - (b.n + wa * ra + wb * rb) * inverse_n;
    const auto open = b.n > zero;
    const auto stick = (!(rn < zero)) & !(ra * ra + rb * rb > mu * mu * rn * rn);
    const auto frictionless = !(mu > zero);
    auto searching = (!open) & (!stick) & (!frictionless);
    if (bits(searching) != 0) {
        // At this lambda mu r_N certainly exceeds |r_T|; without bound where b_N is 0.
        const Pack c = sqrt(ca * ca + cb * cb);
        const Pack pull = sqrt(wa * wa + wb * wb);
        const Pack push = max(zero - b.n, tiny);
        Pack low = zero;
        Pack high = min(c * (w.nn + mu * pull) / (mu * push), Pack(1e100)) + large * Pack(1e-12);
        const Pack na = x * near.t1 + y * near.t2, nb = x * near.t2 - y * near.t1;
        const Pack fa = ca + large * na, fb = cb + small * nb;
        const Pack n_square = na * na + nb * nb;
        const auto known = n_square > tiny;
        const Pack guess = select(known, sqrt((fa * fa + fb * fb) / select(known, n_square, one)),
                                  c * w.nn / (mu * push) - mean);
        Pack lambda = min(max(guess, zero), high);
        for (int i = 0; i < kIterations; ++i) {
            const Pack la = large + lambda, lb = small + lambda, inverse = one / (la * lb);
            const Pack da = lb * inverse, db = la * inverse;
            const Pack ta = zero - ca * da, tb = zero - cb * db;
            const Pack t_square = max(ta * ta + tb * tb, tiny), t = sqrt(t_square);
            const Pack n = zero - (b.n + wa * ta + wb * tb) * inverse_n;
            // Derivatives: ta' = -ta da, tb' = -tb db, |t|' = -fall / |t|. With value = mu n / |t|
            // - 1 the step value / value' is short_of |t|^2 / slope.
            const Pack n_slope = (wa * ta * da + wb * tb * db) * inverse_n;
            const Pack fall = ta * ta * da + tb * tb * db;
            const Pack short_of = mu * n - t;
            const Pack slope = mu * (n_slope * t_square + n * fall);
            ra = select(searching, ta, ra);
            rb = select(searching, tb, rb);
            rn = select(searching, n, rn);
            const auto below = short_of < zero;
            low = select(below, lambda, low);
            high = select(below, high, lambda);
            const Pack next = lambda - short_of * t_square / select(slope > zero, slope, tiny);
            const auto bracketed = (next > low) & (next < high);
            searching = searching & (abs(short_of) > Pack(kConverged) * t);
            if (bits(searching) == 0) break;
            lambda = select(bracketed, next, Pack(0.5) * (low + high));
        }
        // What is left of rounding goes into the friction: |r_T| = mu r_N.
        const auto slip = (!open) & (!stick) & (!frictionless);
        rn = select(slip, max(rn, zero), rn);
        const Pack t = sqrt(max(ra * ra + rb * rb, tiny));
        const Pack scale = mu * rn / t;
        ra = select(slip, ra * scale, ra);
        rb = select(slip, rb * scale, rb);
    }
    const Pack smooth_n = max(zero - b.n * inverse_n, zero);
    rn = select(open, zero, select(frictionless, smooth_n, rn));
    ra = select(open | frictionless, zero, ra);
    rb = select(open | frictionless, zero, rb);
    return {rn, x * ra - y * rb, y * ra + x * rb};
}

// |f_FB| of METHODS 2.10: the Fischer-Burmeister function on the cone, 0 exactly where the Coulomb
// law holds. r and u are divided by their scales already; u_N contains the gap over the step.
template <class Pack>
KERATIN_LANE_INLINE Pack coulomb_residual(const Local3<Pack>& r, const Local3<Pack>& u, Pack mu) {
    const Pack zero(0.0), half(0.5), tiny(1e-300);
    // mu = 0: the scalar function for the normal, |r_T| for the rest.
    const Pack scalar = r.n + u.n - sqrt(r.n * r.n + u.n * u.n);
    const Pack smooth = sqrt(scalar * scalar + r.t1 * r.t1 + r.t2 * r.t2);

    const Pack x0 = mu * r.n, y0 = u.n + mu * sqrt(u.t1 * u.t1 + u.t2 * u.t2);
    const Pack y1 = mu * u.t1, y2 = mu * u.t2;
    const Pack z0 = x0 * x0 + r.t1 * r.t1 + r.t2 * r.t2 + y0 * y0 + y1 * y1 + y2 * y2;
    const Pack z1 = Pack(2.0) * (x0 * r.t1 + y0 * y1), z2 = Pack(2.0) * (x0 * r.t2 + y0 * y2);
    const Pack z = sqrt(z1 * z1 + z2 * z2);
    const Pack root_low = sqrt(max(z0 - z, zero)), root_high = sqrt(z0 + z);
    const Pack along = half * (root_high - root_low) / max(z, tiny);
    const Pack f0 = x0 + y0 - half * (root_high + root_low);
    const Pack f1 = r.t1 + y1 - along * z1, f2 = r.t2 + y2 - along * z2;
    return select(mu > zero, sqrt(f0 * f0 + f1 * f1 + f2 * f2), smooth);
}

// Stands for all larger coefficients, infinity too: a contact under it sticks up to 88.9 degrees of
// slope. The residual grows with mu, so that under a larger one no solve would come to its bound.
constexpr double kMostFriction = 50;

}  // namespace keratin
