#include "runtime/rod/rod_energy.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

using namespace keratin;

namespace {

using Vec = Vector3<Double1>;

// Two edges with their frames and angles: the numbers q[11] that a joint depends on, and the frames
// based at one state.
struct Fixture {
    std::array<double, 11> q{};
    Vec t, u, a_before, a_after;  // base
    double last = 0;
    JointMaterial<Double1> material;
};

Vec vertex(const std::array<double, 11>& q, int i) {
    const auto k = static_cast<std::size_t>(4 * i);
    return {q[k], q[k + 1], q[k + 2]};
}

struct State {
    Joint<Double1> joint;
    double twist;
    Vec a_before, a_after;
    double reference;
};

State state_of(const Fixture& f, const std::array<double, 11>& q) {
    const auto e = edge_geometry(vertex(q, 1) - vertex(q, 0));
    const auto g = edge_geometry(vertex(q, 2) - vertex(q, 1));
    State s;
    s.a_before = transport(f.t, e.tangent, f.a_before);
    s.a_after = transport(f.u, g.tangent, f.a_after);
    s.joint = make_joint(e.tangent, e.inverse_length,
                         material_directors(e.tangent, s.a_before, Double1(q[3])), g.tangent,
                         g.inverse_length, material_directors(g.tangent, s.a_after, Double1(q[7])));
    s.reference = turn_near(transport(e.tangent, g.tangent, s.a_before), s.a_after, g.tangent,
                            Double1(f.last))
                      .v;
    s.twist = q[7] - q[3] + s.reference;
    return s;
}

// The same state with the frames based there.
Fixture rebased(const Fixture& f, const std::array<double, 11>& q) {
    const State s = state_of(f, q);
    Fixture g = f;
    g.q = q;
    g.t = s.joint.t;
    g.u = s.joint.u;
    g.a_before = s.a_before;
    g.a_after = s.a_after;
    g.last = s.reference;
    return g;
}

double energy(const Fixture& f, const std::array<double, 11>& q) {
    const State s = state_of(f, q);
    return bend_energy(f.material, s.joint).v + twist_energy(f.material, Double1(s.twist)).v;
}

std::array<double, 11> gradient(const Fixture& f, const std::array<double, 11>& q) {
    const State s = state_of(f, q);
    const auto g = joint_gradient(f.material, s.joint, Double1(s.twist));
    const Vec mid = g.e - g.f;
    return {-g.e.x.v, -g.e.y.v, -g.e.z.v, g.before.v, mid.x.v, mid.y.v,
            mid.z.v,  g.after.v, g.f.x.v, g.f.y.v,    g.f.z.v};
}

std::array<std::array<double, 11>, 11> hessian(const Fixture& f, double exact) {
    const State s = state_of(f, f.q);
    const auto h = joint_hessian(f.material, s.joint, Double1(s.twist), Double1(exact));
    const double ee[3][3] = {{h.ee.xx.v, h.ee.xy.v, h.ee.xz.v},
                             {h.ee.xy.v, h.ee.yy.v, h.ee.yz.v},
                             {h.ee.xz.v, h.ee.yz.v, h.ee.zz.v}};
    const double ff[3][3] = {{h.ff.xx.v, h.ff.xy.v, h.ff.xz.v},
                             {h.ff.xy.v, h.ff.yy.v, h.ff.yz.v},
                             {h.ff.xz.v, h.ff.yz.v, h.ff.zz.v}};
    const double ef[3][3] = {{h.ef.xx.v, h.ef.xy.v, h.ef.xz.v},
                             {h.ef.yx.v, h.ef.yy.v, h.ef.yz.v},
                             {h.ef.zx.v, h.ef.zy.v, h.ef.zz.v}};
    const double eb[3] = {h.e_before.x.v, h.e_before.y.v, h.e_before.z.v};
    const double fb[3] = {h.f_before.x.v, h.f_before.y.v, h.f_before.z.v};
    const double ea[3] = {h.e_after.x.v, h.e_after.y.v, h.e_after.z.v};
    const double fa[3] = {h.f_after.x.v, h.f_after.y.v, h.f_after.z.v};
    // signs of the edges in x_{i-1}, x_i, x_{i+1}
    const double se[3] = {-1, 1, 0}, sf[3] = {0, -1, 1};
    std::array<std::array<double, 11>, 11> m{};
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
            for (std::size_t r = 0; r < 3; ++r)
                for (std::size_t c = 0; c < 3; ++c)
                    m[4 * a + r][4 * b + c] = se[a] * se[b] * ee[r][c] + sf[a] * sf[b] * ff[r][c] +
                                              se[a] * sf[b] * ef[r][c] + sf[a] * se[b] * ef[c][r];
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t r = 0; r < 3; ++r) {
            m[4 * a + r][3] = m[3][4 * a + r] = se[a] * eb[r] + sf[a] * fb[r];
            m[4 * a + r][7] = m[7][4 * a + r] = se[a] * ea[r] + sf[a] * fa[r];
        }
    m[3][3] = h.before_before.v;
    m[7][7] = h.after_after.v;
    m[3][7] = m[7][3] = h.before_after.v;
    return m;
}

// A joint whose turning angle is about `bend`, everything else random.
Fixture random_joint(std::mt19937_64& random, double bend) {
    std::uniform_real_distribution<double> in(-1, 1);
    const auto unit = [&] {
        for (;;) {
            const Vec v{in(random), in(random), in(random)};
            const double n = std::sqrt(dot(v, v).v);
            if (n > 0.2) return Double1(1 / n) * v;
        }
    };
    Fixture f;
    const Vec t = unit();
    const Vec w = unit();
    const auto side = edge_geometry(w - dot(w, t) * t).tangent;
    const Vec u = Double1(std::cos(bend)) * t + Double1(std::sin(bend)) * side;
    const double le = 1.5 + in(random), lf = 1.5 + in(random);
    const Vec x0{in(random), in(random), in(random)}, x1 = x0 + Double1(le) * t,
              x2 = x1 + Double1(lf) * u;
    f.q = {x0.x.v, x0.y.v, x0.z.v, 3 * in(random), x1.x.v, x1.y.v,
           x1.z.v, 3 * in(random), x2.x.v, x2.y.v, x2.z.v};
    const auto across = [&](const Vec& axis) {
        const Vec v = unit();
        return edge_geometry(v - dot(v, axis) * axis).tangent;
    };
    f.t = t;
    f.u = u;
    f.a_before = across(t);
    f.a_after = across(u);
    f.material = {1.3, 0.7, 0.9, in(random), in(random), in(random), in(random), in(random)};
    return rebased(f, f.q);
}

struct Errors {
    double gradient = 0, hessian = 0;
};

// Central differences with Richardson's correction, about the base, relative to the largest entry.
// A second derivative of the curvature grows with 1/chi^2, so the difference step shrinks with chi.
Errors compare(const Fixture& f, double step) {
    const auto g = gradient(f, f.q);
    const auto h = hessian(f, 1);
    std::array<std::array<double, 11>, 11> numeric{};
    Errors out;
    double largest_g = 0, largest_h = 0;
    for (std::size_t k = 0; k < 11; ++k) {
        const auto shifted = [&](double d) {
            auto q = f.q;
            q[k] += d;
            return q;
        };
        const auto slope = [&](double d) {
            return (energy(f, shifted(d)) - energy(f, shifted(-d))) / (2 * d);
        };
        const double num = (4 * slope(step / 2) - slope(step)) / 3;
        out.gradient = std::max(out.gradient, std::abs(num - g[k]));
        largest_g = std::max(largest_g, std::abs(g[k]));
        const auto change = [&](double d) {
            // the gradient is exact where frames are based, so base them at the shifted states
            const auto up = gradient(rebased(f, shifted(d)), shifted(d));
            const auto down = gradient(rebased(f, shifted(-d)), shifted(-d));
            std::array<double, 11> c;
            for (std::size_t r = 0; r < 11; ++r) c[r] = (up[r] - down[r]) / (2 * d);
            return c;
        };
        const auto fine = change(step / 2), coarse = change(step);
        for (std::size_t r = 0; r < 11; ++r) numeric[r][k] = (4 * fine[r] - coarse[r]) / 3;
    }
    for (std::size_t r = 0; r < 11; ++r)
        for (std::size_t c = 0; c < 11; ++c) {
            out.hessian =
                std::max(out.hessian, std::abs(0.5 * (numeric[r][c] + numeric[c][r]) - h[r][c]));
            largest_h = std::max(largest_h, std::abs(h[r][c]));
        }
    out.gradient /= largest_g;
    out.hessian /= largest_h;
    return out;
}

Errors worst(double bend_low, double bend_high, double step) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> bend(bend_low, bend_high);
    Errors w;
    for (int k = 0; k < 200; ++k) {
        const Errors e = compare(random_joint(random, bend(random)), step);
        w.gradient = std::max(w.gradient, e.gradient);
        w.hessian = std::max(w.hessian, e.hessian);
    }
    return w;
}

}  // namespace

TEST_CASE("bend and twist derivatives agree with finite differences at random states") {
    const Errors e = worst(0.3, 2.2, 1e-3);
    INFO("gradient " << e.gradient << ", Hessian " << e.hessian);
    CHECK(e.gradient < 1e-6);
    CHECK(e.hessian < 1e-5);
}

TEST_CASE("bend and twist derivatives agree with finite differences at nearly straight states") {
    const Errors e = worst(0, 1e-6, 1e-3);
    INFO("gradient " << e.gradient << ", Hessian " << e.hessian);
    CHECK(e.gradient < 1e-6);
    CHECK(e.hessian < 1e-5);
}

TEST_CASE("bend and twist derivatives agree with finite differences at nearly folded states") {
    const double pi = 3.14159265358979;
    const Errors e = worst(pi - 0.05, pi - 0.02, 2e-5);
    INFO("gradient " << e.gradient << ", Hessian " << e.hessian);
    CHECK(e.gradient < 1e-6);
    CHECK(e.hessian < 1e-5);
}

TEST_CASE("stretch derivatives agree with finite differences, stretched, compressed and at rest") {
    const double k = 1.7, rest = 0.8;
    for (const double length : {0.05, 0.8, 1.9}) {
        const Vec direction = Double1(1 / std::sqrt(14.0)) * Vec{1.0, -2.0, 3.0};
        const Vec edge = Double1(length) * direction;
        const auto at = [&](std::size_t c, double d) {
            Vec v = edge;
            (c == 0 ? v.x : c == 1 ? v.y : v.z).v += d;
            return edge_geometry(v);
        };
        const auto g = stretch_gradient(Double1(k), Double1(rest), edge_geometry(edge));
        const auto h = stretch_hessian(Double1(k), Double1(rest), edge_geometry(edge), Double1(1));
        const double gradient[3] = {g.x.v, g.y.v, g.z.v};
        const double t[3] = {direction.x.v, direction.y.v, direction.z.v};
        const double scale = k * std::max(1.0, rest / length);
        for (std::size_t c = 0; c < 3; ++c) {
            const double d = 1e-4 * length;
            const auto slope = [&](double s) {
                const auto e = [&](double x) {
                    return stretch_energy(Double1(k), Double1(rest), at(c, x).length).v;
                };
                return (e(s) - e(-s)) / (2 * s);
            };
            CHECK(std::abs((4 * slope(d / 2) - slope(d)) / 3 - gradient[c]) < 1e-6 * k);
            const auto change = [&](double s) {
                return Double1(1 / (2 * s)) *
                       (stretch_gradient(Double1(k), Double1(rest), at(c, s)) -
                        stretch_gradient(Double1(k), Double1(rest), at(c, -s)));
            };
            const Vec n = Double1(1.0 / 3) * (Double1(4.0) * change(d / 2) - change(d));
            const double numeric[3] = {n.x.v, n.y.v, n.z.v};
            for (std::size_t r = 0; r < 3; ++r) {
                const double exact = h.along.v * t[r] * t[c] + (r == c ? h.across.v : 0);
                CHECK(std::abs(numeric[r] - exact) < 1e-5 * scale);
            }
        }
    }
}

TEST_CASE("the Hessian without second derivatives is positive semidefinite") {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> bend(0, 3.1), in(-1, 1);
    for (int k = 0; k < 200; ++k) {
        const auto m = hessian(random_joint(random, bend(random)), 0);
        for (int trial = 0; trial < 20; ++trial) {
            std::array<double, 11> x;
            for (double& v : x) v = in(random);
            double sum = 0, size = 0;
            for (std::size_t r = 0; r < 11; ++r)
                for (std::size_t c = 0; c < 11; ++c) {
                    sum += x[r] * m[r][c] * x[c];
                    size = std::max(size, std::abs(m[r][c]));
                }
            CHECK(sum > -1e-12 * size);
        }
    }
}

TEST_CASE("transport keeps a director's length and its angle to the tangent") {
    std::mt19937_64 random(3);
    const Fixture f = random_joint(random, 1.1);
    const Vec b = transport(f.t, f.u, f.a_before);
    CHECK(std::abs(dot(b, f.u).v) < 1e-15);
    CHECK(std::abs(dot(b, b).v - 1) < 1e-15);
    const Vec back = transport(f.u, f.t, b) - f.a_before;
    CHECK(dot(back, back).v < 1e-30);
    const Vec folded = transport(f.t, -f.t, f.a_before) - f.a_before;
    CHECK(dot(folded, folded).v < 1e-30);
}

TEST_CASE("the angle between directors is found in every quadrant and counts whole turns") {
    const Vec axis{0.0, 0.0, 1.0}, a{1.0, 0.0, 0.0};
    for (double angle = -20; angle < 20; angle += 0.37) {
        const Vec b{std::cos(angle), std::sin(angle), 0.0};
        CHECK(turn_near(a, b, axis, Double1(angle + 0.5)).v == Approx(angle).epsilon(1e-14).margin(1e-14));
    }
}

TEST_CASE("sine and cosine agree with the library's to rounding") {
    double worst_error = 0;
    for (double x = -400; x < 400; x += 0.0137) {
        Double1 s, c;
        sin_cos(Double1(x), s, c);
        worst_error = std::max({worst_error, std::abs(s.v - std::sin(x)), std::abs(c.v - std::cos(x))});
    }
    CHECK(worst_error < 3e-16);
}
