#include "bake/stage/strand_statics.h"

#include "schema/bend.h"

#include <Eigen/Core>
#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>

namespace keratin {
namespace {

using V = Vec3<double>;
using Pair = Eigen::Vector2d;
using Block = Eigen::Matrix2d;

V across(const V& v, const V& t) { return v - t * dot(v, t); }

// Between the segments m and m + 1.
struct Joint {
    V target;    // g_m
    V reaction;  // (dg_m/dt_m)^T t_{m+1}
};

Joint joint(const StrandStatics& s, std::span<const V> t, std::size_t m) {
    const V& r = s.unloaded[m];
    const double along = dot(r, s.unloaded[m + 1]), inverse = bend_inverse(r, t[m]);
    const V g = bend_target(r, t[m], s.unloaded[m + 1], along, inverse);
    return {g, bend_reaction(r, t[m], g, t[m + 1], along, inverse, 1.0)};
}

// Two directions across each segment.
std::vector<std::array<V, 2>> bases(std::span<const V> t) {
    std::vector<std::array<V, 2>> out(t.size());
    for (std::size_t m = 1; m < t.size(); ++m) {
        out[m][0] = any_perpendicular(t[m]);
        out[m][1] = cross(t[m], out[m][0]);
    }
    return out;
}

// t + basis x, of length one again.
V moved(const V& t, const std::array<V, 2>& basis, const Pair& x) {
    return normalize_or(t + basis[0] * x[0] + basis[1] * x[1], t);
}

// Slope of the energy over the coordinates x of moved(), at directions `now` = moved(t, ...).
std::vector<Pair> slopes(const StrandStatics& s, std::span<const V> t,
                         std::span<const std::array<V, 2>> basis, std::span<const V> now) {
    const std::vector<V> g = gradient(s, now);
    std::vector<Pair> out(t.size(), Pair::Zero());
    for (std::size_t m = 2; m < t.size(); ++m) {
        // |t + basis x| = 1 / t.now.
        const double shrink = dot(t[m], now[m]);
        out[m] = Pair(dot(basis[m][0], g[m]), dot(basis[m][1], g[m])) * shrink;
    }
    return out;
}

// Hessian over the coordinates x at x = 0: blocks on the diagonal, and above it (m, m + 1). Central
// differences of the slopes, segments three apart at once: only neighbours feel each other.
struct Hessian {
    std::vector<Block> diagonal, above;
};
Hessian hessian(const StrandStatics& s, std::span<const V> t,
                std::span<const std::array<V, 2>> basis) {
    constexpr double kStep = 1e-5;
    const std::size_t n = t.size();
    Hessian h{std::vector<Block>(n, Block::Zero()), std::vector<Block>(n, Block::Zero())};
    std::vector<V> now(t.begin(), t.end());
    for (std::size_t colour = 0; colour < 3; ++colour) {
        for (int k = 0; k < 2; ++k) {
            std::vector<Pair> side[2];
            for (int sign = 0; sign < 2; ++sign) {
                Pair x = Pair::Zero();
                x[k] = sign == 0 ? -kStep : kStep;
                for (std::size_t m = 2; m < n; ++m)
                    now[m] = m % 3 == colour ? moved(t[m], basis[m], x) : t[m];
                side[sign] = slopes(s, t, basis, now);
            }
            for (std::size_t m = 2; m < n; ++m) {
                if (m % 3 != colour) continue;
                const auto column = [&](std::size_t row) {
                    return ((side[1][row] - side[0][row]) / (2 * kStep)).eval();
                };
                h.diagonal[m].col(k) = column(m);
                if (m > 2) h.above[m - 1].col(k) = column(m - 1);
            }
        }
    }
    for (Block& d : h.diagonal) d = (0.5 * (d + d.transpose())).eval();
    return h;
}

// Solves (H + shift) x = right; false when that is not positive definite. Block elimination from
// the root to the tip.
bool solve(const Hessian& h, double shift, std::vector<Pair>& x) {
    const std::size_t n = h.diagonal.size();
    std::vector<Block> inverse(n, Block::Zero());
    for (std::size_t m = 2; m < n; ++m) {
        Block d = h.diagonal[m] + shift * Block::Identity();
        if (m > 2) {
            const Block up = h.above[m - 1].transpose() * inverse[m - 1];
            d -= up * h.above[m - 1];
            x[m] -= up * x[m - 1];
        }
        if (!(d(0, 0) > 0 && d.determinant() > 0)) return false;
        inverse[m] = d.inverse();
    }
    for (std::size_t m = n - 1; m >= 2; --m) {
        Pair right = x[m];
        if (m + 1 < n) right -= h.above[m] * x[m + 1];
        x[m] = inverse[m] * right;
    }
    return true;
}

// The moment that the weight of a strand has at its length, for scale.
double weight_moment(const StrandStatics& s) {
    double sum = 0;
    for (std::size_t m = 2; m < s.length.size(); ++m) sum += s.length[m];
    return length(s.gravity) * sum * sum;
}

}  // namespace

std::vector<V> directions(std::span<const V> points) {
    std::vector<V> out(points.size(), V(1, 0, 0));
    for (std::size_t m = 1; m < points.size(); ++m)
        out[m] = normalize_or(points[m] - points[m - 1], out[m - 1]);
    out[0] = out[1];
    return out;
}

StrandStatics strand_statics(std::span<const V> points, double bending, const V& gravity) {
    const std::size_t n = points.size();
    StrandStatics s;
    s.gravity = gravity;
    s.unloaded = directions(points);
    s.length.assign(n, 0);
    s.beyond.assign(n, 0);
    s.stiffness.assign(n, 0);
    for (std::size_t m = 1; m < n; ++m) s.length[m] = length(points[m] - points[m - 1]);
    double mass = 0;
    for (std::size_t m = n - 1; m >= 1; --m) {
        s.beyond[m] = mass + 0.5 * s.length[m];
        mass += s.length[m];
    }
    for (std::size_t m = 1; m + 1 < n; ++m) {
        const double l = s.length[m + 1];
        s.stiffness[m] = joint_stiffness(bending, m == 1 ? 0 : 0.5 * s.length[m], l) * l * l;
    }
    return s;
}

double energy(const StrandStatics& s, std::span<const V> t) {
    double sum = 0;
    for (std::size_t m = 1; m < t.size(); ++m) {
        sum -= s.beyond[m] * s.length[m] * dot(s.gravity, t[m]);
        if (m + 1 < t.size()) sum += s.stiffness[m] * (1 - dot(t[m + 1], joint(s, t, m).target));
    }
    return sum;
}

std::vector<V> gradient(const StrandStatics& s, std::span<const V> t) {
    std::vector<V> out(t.size(), V(0, 0, 0));
    V before(0, 0, 0);  // S_{m-1} g_{m-1}
    for (std::size_t m = 1; m < t.size(); ++m) {
        V force = s.gravity * (s.beyond[m] * s.length[m]) + before;
        if (m + 1 < t.size()) {
            const Joint j = joint(s, t, m);
            force += j.reaction * s.stiffness[m];
            before = j.target * s.stiffness[m];
        }
        if (m >= 2) out[m] = -across(force, t[m]);
    }
    return out;
}

double residual(const StrandStatics& s, std::span<const V> t) {
    const std::vector<V> g = gradient(s, t);
    double worst = 0, free = 0;
    for (std::size_t m = 2; m < t.size(); ++m) {
        worst = std::max(worst, length(g[m]) / s.length[m]);
        free += s.length[m];
    }
    const double weight = length(s.gravity) * free;
    return weight > 0 ? worst / weight : 0;
}

bool stable(const StrandStatics& s, std::span<const V> t, double margin) {
    std::vector<Pair> x(t.size(), Pair::Zero());
    return solve(hessian(s, t, bases(t)), -margin * weight_moment(s), x);
}

std::vector<V> settled(const StrandStatics& s, std::vector<V> t) {
    // Newton's method with a shift that makes every step go downhill (Levenberg-Marquardt).
    constexpr int kMost = 200;
    const double scale = weight_moment(s);
    constexpr double kStill = 1e-9;
    double shift = 0, now = energy(s, t);
    for (int step = 0; step < kMost; ++step) {
        const auto basis = bases(t);
        std::vector<Pair> slope = slopes(s, t, basis, t);
        const Hessian h = hessian(s, t, basis);
        for (;;) {
            std::vector<Pair> x = slope;
            if (solve(h, shift, x)) {
                double longest = 0;
                std::vector<V> next = t;
                for (std::size_t m = 2; m < t.size(); ++m) {
                    longest = std::max(longest, x[m].norm());
                    next[m] = moved(t[m], basis[m], -x[m]);
                }
                const double there = energy(s, next);
                if (longest < kStill) return next;
                if (longest < 1 && there <= now) {
                    t = std::move(next);
                    now = there;
                    shift = shift < 1e-6 * scale ? 0 : 0.25 * shift;
                    break;
                }
            }
            shift = std::max(4 * shift, 1e-3 * scale);
            if (!(shift < 1e12 * scale)) return t;
        }
    }
    return t;
}

void carry_weight(StrandStatics& s, std::span<const V> t, double most) {
    // Targets need the reactions of the joints further out, and these the unloaded directions,
    // which follow from the targets root first: rounds, half way each, until nothing moves.
    constexpr int kRounds = 200;
    constexpr double kStill = 1e-13;
    const std::size_t n = t.size();
    std::vector<V> target(n, V(0, 0, 0));
    for (int round = 0; round < kRounds; ++round) {
        for (std::size_t m = n - 1; m >= 2; --m) {
            V load = s.gravity * (s.beyond[m] * s.length[m]);
            if (m + 1 < n) {
                const V& r = s.unloaded[m];
                const V& g = target[m];
                load += bend_reaction(r, t[m], g, t[m + 1], dot(t[m], g), bend_inverse(r, t[m]),
                                      s.stiffness[m]);
            }
            V side = across(load, t[m]) * (-1 / s.stiffness[m - 1]);
            const double sine = length(side);
            if (sine > most) side = side * (most / sine);
            target[m - 1] = side + t[m] * std::sqrt(1 - dot(side, side));
        }
        double moved = 0;
        for (std::size_t m = 1; m + 1 < n; ++m) {
            const V next = normalize_or(minimal_turn(t[m], s.unloaded[m], target[m]), t[m + 1]);
            moved = std::max(moved, length(next - s.unloaded[m + 1]));
            s.unloaded[m + 1] = normalize_or(next + s.unloaded[m + 1], next);
        }
        if (moved < kStill) break;
    }
}

}  // namespace keratin
