#include "runtime/contact/impulse_pass.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

// H M^-1 H^T of one contact with each mass divided by the number of active contacts there, reduced
// to one number for the normal and one for the tangents: the larger eigenvalue of the tangent
// block.
struct LocalK {
    double n = 0, t = 0;
};

LocalK lumped(const ContactLaw& law, std::span<const double> inverse_mass,
              std::span<const float> count) {
    double nn = 0, t11 = 0, t12 = 0, t22 = 0;
    for (std::uint32_t side = 0; side < law.sides; ++side) {
        const SideRows& rows = law.rows[side];
        for (int i = 0; i < 7; ++i) {
            const std::size_t at = rows.first + static_cast<std::size_t>(i) * rows.stride;
            const double m = inverse_mass[at] * std::max(1.0f, count[at]);
            const double n = rows.weight[0][i], a = rows.weight[1][i], b = rows.weight[2][i];
            nn += m * n * n, t11 += m * a * a, t12 += m * a * b, t22 += m * b * b;
        }
    }
    return {nn, 0.5 * (t11 + t22) + std::sqrt(0.25 * (t11 - t22) * (t11 - t22) + t12 * t12)};
}

// 1/m + s^2/I of a rigid rod with the edge's mass, s = (alpha - 1/2) |e| and I = m |e|^2 / 12.
// Edges with a prescribed end keep their lumped inertia.
LocalK rigid(const ContactLaw& law, std::span<const double> inverse_mass,
             std::span<const float> count) {
    double k = 0;
    for (std::uint32_t side = 0; side < law.sides; ++side) {
        const SideRows& rows = law.rows[side];
        const std::size_t a = rows.first, b = a + 4 * static_cast<std::size_t>(rows.stride);
        if (inverse_mass[a] == 0 || inverse_mass[b] == 0) return lumped(law, inverse_mass, count);
        const double ma = 1 / (inverse_mass[a] * std::max(1.0f, count[a])),
                     mb = 1 / (inverse_mass[b] * std::max(1.0f, count[b]));
        const double mass = 0.5 * (ma + mb);
        // The weight of the second end along the normal is alpha, up to the arm's small part.
        double alpha = 0;
        for (int i = 0; i < 3; ++i)
            alpha += (rows.weight[0][i] + rows.weight[0][4 + i]) * rows.weight[0][4 + i];
        k += (1 + 12 * (alpha - 0.5) * (alpha - 0.5)) / mass;
    }
    const LocalK least = lumped(law, inverse_mass, count);
    return {std::max(k, least.n), std::max(k, least.t)};
}

}  // namespace

void relative_velocity(const ContactLaw& law, std::span<const double> v, double* u) {
    for (int k = 0; k < 3; ++k) u[k] = law.constant[k];
    for (std::uint32_t side = 0; side < law.sides; ++side) add_velocity(law.rows[side], v, u);
}

double ImpulsePass::run(std::span<const ContactLaw> laws, std::span<const double> v,
                        std::span<const double> inverse_mass, LocalInertia inertia, int threads,
                        std::span<double> impulses) {
    const std::size_t n = laws.size();
    active_.resize(n);
    u_.resize(3 * n);
    count_.resize(v.size());
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t c = 0; c < n; ++c) {
        relative_velocity(laws[c], v, &u_[3 * c]);
        active_[c] = impulses[3 * c] > 0 || u_[3 * c] < 0;
    }
    // A contact is at a vertex when it moves it by more than the couple of its arm does.
    constexpr double kAtVertex = 0.05;
    auto numbers = [&](const ContactLaw& law, auto&& visit) {
        for (std::uint32_t side = 0; side < law.sides; ++side)
            for (int i = 0; i < 7; ++i) {
                double weight = 0;
                for (int k = 0; k < 3; ++k)
                    weight = std::max(weight, std::fabs(law.rows[side].weight[k][i]));
                if (i == 3 ? weight > 0 : weight > kAtVertex)
                    visit(count_[law.rows[side].first +
                                 static_cast<std::size_t>(i) * law.rows[side].stride]);
            }
    };
    std::fill(count_.begin(), count_.end(), 0.0f);
    for (std::size_t c = 0; c < n; ++c)
        if (active_[c]) numbers(laws[c], [](float& k) { k += 1; });

    double change = 0;
    for (std::size_t c = 0; c < n; ++c) {
        if (!active_[c]) continue;
        const ContactLaw& law = laws[c];
        const LocalK k = inertia == LocalInertia::lumped ? lumped(law, inverse_mass, count_)
                                                         : rigid(law, inverse_mass, count_);
        if (!(k.n > 0) || !(k.t > 0)) continue;  // nothing here can move
        double* r = &impulses[3 * c];
        const double* u = &u_[3 * c];
        const double n_new = std::max(0.0, r[0] - u[0] / k.n);
        double t1 = r[1] - u[1] / k.t, t2 = r[2] - u[2] / k.t;
        const double t = std::sqrt(t1 * t1 + t2 * t2), most = law.friction * n_new;
        if (t > most) {
            t1 *= most / t;
            t2 *= most / t;
        }
        const double dn = n_new - r[0], d1 = t1 - r[1], d2 = t2 - r[2];
        change += std::sqrt(dn * dn + d1 * d1 + d2 * d2);
        r[0] = n_new, r[1] = t1, r[2] = t2;
    }
    return change;
}

}  // namespace keratin
