#include "runtime/contact/contact_newton.h"

#include "runtime/contact/coulomb.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace keratin;

namespace {

// Contacts under the law u = W r + b.
struct Problem {
    std::size_t contacts;
    std::vector<double> w, b, friction, r, u;
    ContactNewtonSettings settings{1, 1, 1e-9};

    explicit Problem(std::size_t count, double mu)
        : contacts(count), w(9 * count * count), b(3 * count), friction(count, mu), r(3 * count) {}
    std::size_t size() const { return 3 * contacts; }
    double& at(std::size_t i, std::size_t j) { return w[i * size() + j]; }
    void begin() { u = velocities(); }
    std::vector<double> velocities() const {
        std::vector<double> out(b);
        for (std::size_t i = 0; i < size(); ++i)
            for (std::size_t j = 0; j < size(); ++j) out[i] += w[i * size() + j] * r[j];
        return out;
    }
    double residual() const { return sum_of_residuals(friction, settings, r, velocities()); }
    double solve() {
        ContactNewton newton;
        return newton.solve(w, friction, settings, r, u);
    }
};

// A rope of unit point masses joined by springs of `stiffness` (times the step squared), pressed on
// the ground by 1 each and pulled at one end by `pull`: contacts slide from there up to where their
// friction has taken the pull up.
Problem rope(std::size_t points, double stiffness, double mu, double pull) {
    Problem p(points, mu);
    // W of the tangent along the rope: inverse of 1 + stiffness times the chain, by elimination.
    std::vector<double> a(points * points, 0.0), inverse(points * points, 0.0);
    for (std::size_t i = 0; i < points; ++i) {
        a[i * points + i] = 1;
        inverse[i * points + i] = 1;
    }
    for (std::size_t i = 0; i + 1 < points; ++i) {
        a[i * points + i] += stiffness;
        a[(i + 1) * points + i + 1] += stiffness;
        a[i * points + i + 1] -= stiffness;
        a[(i + 1) * points + i] -= stiffness;
    }
    for (std::size_t k = 0; k < points; ++k) {
        const double d = 1 / a[k * points + k];
        for (std::size_t j = 0; j < points; ++j) {
            a[k * points + j] *= d;
            inverse[k * points + j] *= d;
        }
        for (std::size_t i = 0; i < points; ++i) {
            const double f = a[i * points + k];
            if (i == k || f == 0) continue;
            for (std::size_t j = 0; j < points; ++j) {
                a[i * points + j] -= f * a[k * points + j];
                inverse[i * points + j] -= f * inverse[k * points + j];
            }
        }
    }
    for (std::size_t i = 0; i < points; ++i) {
        p.at(3 * i, 3 * i) = p.at(3 * i + 2, 3 * i + 2) = 1;
        p.b[3 * i] = -1;
        for (std::size_t j = 0; j < points; ++j)
            p.at(3 * i + 1, 3 * j + 1) = inverse[i * points + j];
        p.b[3 * i + 1] = inverse[i * points] * pull;
    }
    p.begin();
    return p;
}

}  // namespace

TEST_CASE("contacts on one stiff rope come under the Coulomb law together") {
    // 60 points can hold 18; beyond that the rope slides.
    for (const double pull : {3.0, 17.0, 25.0}) {
        Problem p = rope(60, 1e5, 0.3, pull);
        INFO("pull " << pull);
        CHECK(p.solve() <= 1e-8);
        CHECK(p.residual() <= 1e-7);
        // The pull goes into friction and into the speed of the sliding points.
        const std::vector<double> u = p.velocities();
        double held = 0, speed = 0;
        for (std::size_t c = 0; c < p.contacts; ++c) {
            held -= p.r[3 * c + 1];
            speed += u[3 * c + 1];
        }
        CHECK(held + speed == Approx(pull).epsilon(1e-8));
        if (pull > 18) CHECK(held == Approx(18).epsilon(1e-8));
        if (pull < 18) CHECK(u[3 * 59 + 1] == Approx(0).margin(1e-9));  // the far end sticks
    }
}

TEST_CASE("contacts that say the same as others share the load") {
    // Every contact is there twice, so that W has no inverse.
    Problem single = rope(8, 100, 0.3, 2.0), twice(16, 0.3);
    for (std::size_t i = 0; i < twice.size(); ++i) {
        twice.b[i] = single.b[i % single.size()];
        for (std::size_t j = 0; j < twice.size(); ++j)
            twice.at(i, j) = single.at(i % single.size(), j % single.size());
    }
    twice.begin();
    CHECK(twice.solve() <= 1e-8);
    single.solve();
    const std::vector<double> u = single.velocities(), v = twice.velocities();
    for (std::size_t i = 0; i < u.size(); ++i) CHECK(v[i] == Approx(u[i]).margin(1e-7));
}

TEST_CASE("what contacts begin with is never made worse") {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    for (int round = 0; round < 20; ++round) {
        Problem p(6, round % 3 == 0 ? 0.0 : 1.0);
        std::vector<double> h(p.size() * 10);
        for (double& x : h) x = normal(random);
        for (std::size_t i = 0; i < p.size(); ++i)
            for (std::size_t j = 0; j < p.size(); ++j)
                for (std::size_t k = 0; k < 10; ++k)
                    p.at(i, j) += h[10 * i + k] * h[10 * j + k];  // of rank 10 of 18
        for (double& x : p.b) x = normal(random);
        p.begin();
        const double before = p.residual();
        const double after = p.solve();
        CHECK(after <= before);
        CHECK(p.residual() == Approx(after).margin(1e-5));
    }
}
