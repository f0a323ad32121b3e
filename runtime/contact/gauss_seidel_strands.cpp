// Contacts of a strand solved together.
#include "runtime/contact/coulomb.h"
#include "runtime/contact/gauss_seidel_memory.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

// Contacts of a strand that are solved together at most.
constexpr std::uint32_t kMostTogether = 128;
constexpr std::uint32_t kStrandPatience = 4;  // rounds over the strands: see kProgress

}  // namespace

void GaussSeidel::Memory::solve_together(std::span<const ContactLaw> laws,
                                         std::span<const SidePlace> places,
                                         const GaussSeidelSettings& settings,
                                         std::span<double> impulses) {
    const std::size_t number = together.size(), n = 3 * number;
    u.resize(n);
    r.resize(n);
    friction.resize(number);
    for (std::size_t i = 0; i < number; ++i) {
        const std::uint32_t c = together[i];
        read_velocity(laws, c, &u[3 * i]);
        friction[i] = std::min(laws[c].friction, kMostFriction);
        for (std::size_t k = 0; k < 3; ++k) r[3 * i + k] = impulses[3 * c + k];
    }
    ContactNewtonSettings newton{settings.velocity_scale, settings.impulse_scale,
                                 settings.residual * static_cast<double>(number)};
    if (sum_of_residuals(friction, newton, r, u) <= newton.residual) return;
    w.assign(n * n, 0.0);
    for (std::size_t i = 0; i < number; ++i)
        for (std::size_t j = 0; j < number; ++j)
            add_coupling(laws, places, together[i], together[j], now.exact.data(),
                         &w[3 * i * n + 3 * j], n);
    contact_newton.solve(w, friction, newton, r, u);
    for (std::size_t i = 0; i < number; ++i) {
        const std::uint32_t c = together[i];
        for (std::size_t k = 0; k < 3; ++k) {
            const double change = r[3 * i + k] - impulses[3 * c + k];
            if (change == 0) continue;
            impulses[3 * c + k] = r[3 * i + k];
            for (std::uint32_t side = 0; side < laws[c].sides; ++side) {
                const SweepSide& give = sides[2 * c + side];
                const double* column = now.exact.data() + give.column + k * give.rows;
                double* numbers = state.data() + give.state;
                for (std::uint32_t row = 0; row < give.rows; ++row)
                    numbers[row] += change * column[row];
            }
        }
    }
}

GaussSeidelReport GaussSeidel::solve_strands(std::span<const ContactLaw> laws,
                                             std::span<const SidePlace> places,
                                             std::span<const double> v,
                                             std::span<const double> applied,
                                             const GaussSeidelSettings& settings,
                                             std::span<double> impulses) {
    Memory& m = *memory_;
    const std::size_t contacts = laws.size();
    GaussSeidelReport report;
    if (contacts == 0 || m.now.exact.empty()) return report;
    m.write_state(laws, v, applied, impulses, m.now.exact.data(), settings.threads);
    m.first_impulse.assign(impulses.begin(), impulses.end());
    m.best_impulse.assign(impulses.begin(), impulses.end());
    const ContactNewtonSettings scales{settings.velocity_scale, settings.impulse_scale, 0};
    auto mean_residual = [&] {
        double sum = 0;
        for (std::uint32_t c = 0; c < contacts; ++c) {
            double u[3];
            m.read_velocity(laws, c, u);
            const double mu[1] = {std::min(laws[c].friction, kMostFriction)};
            sum += sum_of_residuals(mu, scales, impulses.subspan(3 * c, 3), u);
        }
        return sum / static_cast<double>(contacts);
    };
    report.start = report.residual = mean_residual();
    double best = report.residual;
    std::uint32_t best_round = 0;
    double kept_residual = report.residual;
    while (report.sweeps < settings.most_sweeps && report.residual > settings.residual) {
        for (const std::uint32_t s : m.touched) {
            const Memory::StrandPart& part = m.now.strands[s];
            // More contacts than numbers contradict each other: sweeps with eased gaps do better.
            // And the time goes with the cube.
            if (part.dense || part.side_count > kMostTogether) continue;
            m.together.clear();
            for (std::uint32_t j = 0; j < part.side_count; ++j)
                m.together.push_back(m.now.side_order[part.first_side + j] / 2);
            std::sort(m.together.begin(), m.together.end());
            m.together.erase(std::unique(m.together.begin(), m.together.end()), m.together.end());
            m.solve_together(laws, places, settings, impulses);
        }
        ++report.sweeps;
        report.residual = mean_residual();
        if (report.residual < kept_residual) {
            kept_residual = report.residual;
            std::copy(impulses.begin(), impulses.end(), m.best_impulse.begin());
        }
        if (report.residual < kProgress * best) {
            best = report.residual;
            best_round = report.sweeps;
        } else if (report.sweeps >= best_round + kStrandPatience) {
            break;
        }
    }
    report.residual = kept_residual;
    std::copy(m.best_impulse.begin(), m.best_impulse.end(), impulses.begin());
    for (std::size_t c = 0; c < contacts; ++c) {
        double square = 0;
        for (std::size_t k = 3 * c; k < 3 * c + 3; ++k)
            square += (impulses[k] - m.first_impulse[k]) * (impulses[k] - m.first_impulse[k]);
        report.change += std::sqrt(square);
    }
    return report;
}

}  // namespace keratin
