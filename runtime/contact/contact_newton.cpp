#include "runtime/contact/contact_newton.h"

#include "runtime/contact/coulomb.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

// Newton's method takes whole steps first, uphill too: on its way to the right set of sticking and
// sliding contacts the residual may rise a thousandfold. Where that has led nowhere, steps are kept
// small enough to go downhill. Numbers of steps in a row that bring nothing:
constexpr int kFreeSteps = 12, kSafeSteps = 15;
// Of the diagonal: added to W in the linear system, so that contacts which share a load in more
// than one way have one answer, the nearest; more of it makes steps smaller. The law itself keeps
// the true W.
constexpr double kNearest = 1e-10, kFirstDamping = 1e-6, kMostDamping = 1e2, kDampingUp = 20,
                 kDampingDown = 10;
constexpr int kSweeps = 4;  // where no step goes downhill

// Solves a x = b in place by elimination with row exchanges; false at a pivot of 0.
bool eliminate(std::size_t n, double* a, double* b) {
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < n; ++i)
            if (std::fabs(a[i * n + k]) > std::fabs(a[pivot * n + k])) pivot = i;
        if (!(std::fabs(a[pivot * n + k]) > 0)) return false;
        if (pivot != k) {
            std::swap_ranges(a + k * n + k, a + (k + 1) * n, a + pivot * n + k);
            std::swap(b[k], b[pivot]);
        }
        const double inverse = 1 / a[k * n + k];
        for (std::size_t i = k + 1; i < n; ++i) {
            const double f = a[i * n + k] * inverse;
            if (f == 0) continue;
            for (std::size_t j = k + 1; j < n; ++j) a[i * n + j] -= f * a[k * n + j];
            b[i] -= f * b[k];
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        double x = b[k];
        for (std::size_t j = k + 1; j < n; ++j) x -= a[k * n + j] * b[j];
        b[k] = x / a[k * n + k];
    }
    return true;
}

}  // namespace

double sum_of_residuals(std::span<const double> friction, const ContactNewtonSettings& settings,
                        std::span<const double> r, std::span<const double> u) {
    const double us = 1 / settings.velocity_scale, rs = 1 / settings.impulse_scale;
    double sum = 0;
    for (std::size_t c = 0; c < friction.size(); ++c)
        sum +=
            coulomb_residual(Local3<Double1>{r[3 * c] * rs, r[3 * c + 1] * rs, r[3 * c + 2] * rs},
                             Local3<Double1>{u[3 * c] * us, u[3 * c + 1] * us, u[3 * c + 2] * us},
                             Double1(friction[c]))
                .v;
    return sum;
}

bool ContactNewton::step(std::span<const double> w, std::span<const double> friction,
                         std::span<const double> r, std::span<const double> u, double damping) {
    const std::size_t n = r.size();
    matrix_.assign(n * n, 0.0);
    step_.resize(n);
    for (std::size_t c = 0; c < friction.size(); ++c) {
        const std::size_t i = 3 * c;
        const double wn = w[i * n + i],
                     wt = std::max(w[(i + 1) * n + i + 1], w[(i + 2) * n + i + 2]);
        const double mu = friction[c];
        // Row k of the matrix: `f` times row i + k of W (with what makes it definite).
        auto add_row = [&](std::size_t to, std::size_t from, double f) {
            double* row = matrix_.data() + to * n;
            for (std::size_t j = 0; j < n; ++j) row[j] += f * w[from * n + j];
            row[from] += f * damping * w[from * n + from];
        };
        const double an = r[i] - u[i] / wn;
        if (!(an > 0)) {
            for (std::size_t k = 0; k < 3; ++k) {
                matrix_[(i + k) * n + i + k] = 1;
                step_[i + k] = -r[i + k];
            }
            continue;
        }
        add_row(i, i, 1 / wn);
        step_[i] = -u[i] / wn;
        const double a1 = r[i + 1] - u[i + 1] / wt, a2 = r[i + 2] - u[i + 2] / wt;
        const double size = std::hypot(a1, a2), radius = mu * an;
        if (size <= radius) {
            for (std::size_t k = 1; k < 3; ++k) {
                add_row(i + k, i + k, 1 / wt);
                step_[i + k] = -u[i + k] / wt;
            }
            continue;
        }
        // r_T = mu a_N a_T / |a_T|
        const double t[2] = {a1 / size, a2 / size}, share = radius / size;
        for (std::size_t k = 0; k < 2; ++k) {
            const std::size_t row = i + 1 + k;
            matrix_[row * n + row] += 1;
            // - mu t da_N, da_N = dr_N - du_N / w_N
            matrix_[row * n + i] -= mu * t[k];
            add_row(row, i, mu * t[k] / wn);
            // - share (1 - t t^T) da_T
            for (std::size_t l = 0; l < 2; ++l) {
                const double p = share * ((k == l ? 1 : 0) - t[k] * t[l]);
                matrix_[row * n + i + 1 + l] -= p;
                add_row(row, i + 1 + l, p / wt);
            }
            step_[row] = radius * t[k] - r[row];
        }
    }
    if (!eliminate(n, matrix_.data(), step_.data())) return false;
    return std::all_of(step_.begin(), step_.end(), [](double x) { return std::isfinite(x); });
}

void ContactNewton::sweep(std::span<const double> w, std::span<const double> friction,
                          std::span<double> r, std::span<double> u) {
    const std::size_t n = r.size();
    for (std::size_t c = 0; c < friction.size(); ++c) {
        const std::size_t i = 3 * c;
        auto at = [&](std::size_t k, std::size_t l) { return w[(i + k) * n + i + l]; };
        const Delassus<Double1> own{at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)};
        const Local3<Double1> now{r[i], r[i + 1], r[i + 2]};
        double rest[3];
        for (std::size_t k = 0; k < 3; ++k)
            rest[k] = u[i + k] - (at(k, 0) * r[i] + at(k, 1) * r[i + 1] + at(k, 2) * r[i + 2]);
        const Local3<Double1> next =
            solve_one_contact(own, {rest[0], rest[1], rest[2]}, Double1(friction[c]), now);
        const double d[3] = {next.n.v - r[i], next.t1.v - r[i + 1], next.t2.v - r[i + 2]};
        for (std::size_t k = 0; k < 3; ++k) {
            if (d[k] == 0) continue;
            r[i + k] += d[k];
            const double* column = w.data() + (i + k) * n;  // W is symmetric
            for (std::size_t j = 0; j < n; ++j) u[j] += column[j] * d[k];
        }
    }
}

double ContactNewton::solve(std::span<const double> w, std::span<const double> friction,
                            const ContactNewtonSettings& settings, std::span<double> impulses,
                            std::span<double> velocities) {
    const std::size_t n = impulses.size();
    double best = sum_of_residuals(friction, settings, impulses, velocities);
    r_.assign(impulses.begin(), impulses.end());
    u_.assign(velocities.begin(), velocities.end());
    auto keep = [&] {
        const double now = sum_of_residuals(friction, settings, r_, u_);
        if (!(now < best)) return false;
        best = now;
        std::copy(r_.begin(), r_.end(), impulses.begin());
        std::copy(u_.begin(), u_.end(), velocities.begin());
        return true;
    };
    auto go_back = [&] {
        std::copy(impulses.begin(), impulses.end(), r_.begin());
        std::copy(velocities.begin(), velocities.end(), u_.begin());
    };
    auto take = [&](double damping) {
        if (!step(w, friction, r_, u_, damping)) return false;
        for (std::size_t i = 0; i < n; ++i) {
            r_[i] += step_[i];
            double sum = 0;
            for (std::size_t j = 0; j < n; ++j) sum += w[i * n + j] * step_[j];
            u_[i] += sum;
        }
        return true;
    };
    // A front between sliding and sticking contacts moves by one contact a step at worst.
    int left = static_cast<int>(friction.size()) + kFreeSteps + kSafeSteps;
    for (int idle = 0; idle < kFreeSteps && best > settings.residual && left > 0; --left) {
        if (!take(kNearest)) break;
        idle = keep() ? 0 : idle + 1;
    }
    double damping = kFirstDamping;
    for (int idle = 0; idle < kSafeSteps && best > settings.residual && left > 0; --left) {
        go_back();
        ++idle;
        if (take(damping) && keep()) {
            damping = std::max(damping / kDampingDown, kNearest);
            idle = 0;
        } else if (damping < kMostDamping) {
            damping *= kDampingUp;
        } else {
            go_back();
            for (int i = 0; i < kSweeps; ++i) sweep(w, friction, r_, u_);
            if (!keep()) break;
            damping = kFirstDamping;
        }
    }
    return best;
}

}  // namespace keratin
