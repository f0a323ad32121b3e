#include "tools/keratin-report/elastica.h"

#include "runtime/rod/double3.h"

#include <algorithm>
#include <cmath>

namespace keratin::report {

namespace {

constexpr std::size_t kNodes = 2000;

// One Newton solve from where theta stands; gamma = w L^3 / B on the unit length.
void solve(std::vector<double>& theta, double gamma) {
    const std::size_t n = theta.size() - 1;
    const double h = 1 / static_cast<double>(n);
    std::vector<double> diagonal(n + 1), rhs(n + 1);
    for (int round = 0; round < 60; ++round) {
        // theta[i-1] - 2 theta[i] + theta[i+1] = h^2 gamma (1 - s) cos theta[i]; a mirrored node past the tip
        double largest = 0;
        diagonal[0] = 1, rhs[0] = 0;
        for (std::size_t i = 1; i <= n; ++i) {
            const double load = h * h * gamma * (1 - static_cast<double>(i) * h);
            const double next = i < n ? theta[i + 1] : theta[i - 1];
            const double residual = theta[i - 1] - 2 * theta[i] + next - load * std::cos(theta[i]);
            const double lower = i < n ? 1 : 2;
            diagonal[i] = -2 + load * std::sin(theta[i]);
            rhs[i] = -residual;
            if (i > 1) {
                const double share = lower / diagonal[i - 1];
                diagonal[i] -= share;
                rhs[i] -= share * rhs[i - 1];
            }
        }
        double change = 0;
        for (std::size_t i = n; i >= 1; --i) {
            change = (rhs[i] - (i < n ? change : 0)) / diagonal[i];
            rhs[i] = change;
            largest = std::max(largest, std::fabs(change));
        }
        const double damp = std::min(1.0, 0.5 / largest);
        for (std::size_t i = 1; i <= n; ++i) theta[i] += damp * rhs[i];
        if (largest < 1e-12) return;
    }
}

}  // namespace

std::vector<Double3> hanging_shape(const Double3& direction, double length, double weight, double bending,
                                   std::span<const double> at) {
    const double flat = std::hypot(direction[0], direction[2]);
    const Double3 outwards = flat > 1e-9 ? Double3{direction[0] / flat, 0, direction[2] / flat} : Double3{1, 0, 0};
    std::vector<double> theta(kNodes + 1, std::atan2(direction[1], flat));
    const double gamma = bending > 0 ? weight * length * length * length / bending : 1e9;
    for (double g = 0.1; g < gamma; g *= 1.5) solve(theta, g);
    solve(theta, gamma);
    std::vector<Double3> line{{0, 0, 0}};
    const double h = length / kNodes;
    for (std::size_t i = 0; i < kNodes; ++i) {
        const double middle = (theta[i] + theta[i + 1]) / 2;
        line.push_back(add(line.back(), add(scaled(h * std::cos(middle), outwards), {0, h * std::sin(middle), 0})));
    }
    std::vector<Double3> out;
    for (const double s : at) {
        const double place = std::clamp(s / h, 0.0, static_cast<double>(kNodes));
        const auto i = std::min(static_cast<std::size_t>(place), kNodes - 1);
        out.push_back(add(line[i], scaled(place - static_cast<double>(i), subtract(line[i + 1], line[i]))));
    }
    return out;
}

}  // namespace keratin::report
