#include "runtime/contact/impulse_pass.h"

#include "runtime/contact/coulomb.h"
#include "runtime/contact/contact_list.h"
#include "runtime/contact/detection.h"
#include "tests/contact/chains.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace keratin;

namespace {

constexpr double r = 5e-5, mass = 5e-8, spin_inertia = 6e-17, step = 1e-3;

struct System {
    Chains chains;
    std::vector<Contact> contacts;
    std::vector<ContactLaw> laws;
    std::vector<ContactFrame> frames;
    std::vector<double> inverse_mass;

    std::size_t numbers() const { return 4 * chains.x_t0.size(); }

    void find(double friction, std::vector<MovingShape> colliders = {}) {
        Detection detection;
        DetectionSettings settings;
        settings.friction = friction;
        merge_contacts(detection.find(chains.view(), colliders, settings), contacts);
        inverse_mass.assign(numbers(), 1 / mass);
        for (std::size_t i = 0; i < numbers(); i += 4) {
            inverse_mass[i + 3] = 1 / spin_inertia;
            if (chains.prescribed[i / 4])
                for (int k = 0; k < 3; ++k) inverse_mass[i + k] = 0;
        }
        for (const Contact& c : contacts) {
            const ContactFrame frame = contact_frame(c.normal);
            ContactLaw law{};
            law.friction = c.friction;
            law.sides = c.against_collider ? 1 : 2;
            for (int k = 0; k < 3; ++k) law.constant[k] = -dot(frame.axis[k], c.obstacle_velocity);
            law.constant[0] += c.gap / step;
            for (std::uint32_t side = 0; side < law.sides; ++side)
                law.rows[side] = make_rows(chains.view(), c, static_cast<int>(side), frame,
                                           4 * chains.first_vertex[c.edge[side]], 1);
            laws.push_back(law);
            frames.push_back(frame);
        }
    }

    Vector3 common_point(std::size_t c, int side) const {
        const Contact& contact = contacts[c];
        const std::uint32_t v = chains.first_vertex[contact.edge[side]];
        return mix(chains.x_t0[v], chains.x_t0[v + 1], contact.parameter[side]) + contact.arm[side];
    }

    std::vector<double> free_velocity() const {
        std::vector<double> v(numbers(), 0.0);
        for (std::size_t i = 0; i < chains.x_t0.size(); ++i) {
            const Vector3 d = (chains.x_t1[i] - chains.x_t0[i]) * (1 / step);
            v[4 * i] = d.x, v[4 * i + 1] = d.y, v[4 * i + 2] = d.z;
        }
        return v;
    }

    // Masses without springs: v = v_free + M^-1 H^T r.
    std::vector<double> velocity(const std::vector<double>& free,
                                 const std::vector<double>& impulses) const {
        std::vector<double> p(numbers(), 0.0);
        for (std::size_t c = 0; c < laws.size(); ++c)
            for (std::uint32_t side = 0; side < laws[c].sides; ++side)
                add_impulse(laws[c].rows[side], &impulses[3 * c], p);
        for (std::size_t i = 0; i < p.size(); ++i) p[i] = free[i] + inverse_mass[i] * p[i];
        return p;
    }

    double residual(const std::vector<double>& v, const std::vector<double>& impulses) const {
        double sum = 0;
        const double us = 1e-2, rs = us * mass;
        for (std::size_t c = 0; c < laws.size(); ++c) {
            double u[3];
            relative_velocity(laws[c], v, u);
            const double* p = &impulses[3 * c];
            sum += coulomb_residual(Local3<Double1>{p[0] / rs, p[1] / rs, p[2] / rs},
                                    Local3<Double1>{u[0] / us, u[1] / us, u[2] / us},
                                    Double1(laws[c].friction))
                       .v;
        }
        return sum / static_cast<double>(laws.size());
    }
};

// A heap: strands across each other in a small cube, each on its way.
System heap(int strands, double friction, unsigned seed) {
    System s;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 0.01);
    for (int i = 0; i < strands; ++i) {
        const Vector3 a{unit(random), unit(random), unit(random)},
            b{unit(random), unit(random), unit(random)};
        s.chains.add({a, (a + b) * 0.5 + Vector3(3e-4, 0, 0), b},
                     {0.1 * unit(random), 0.1 * unit(random), 0.1 * unit(random)}, r);
    }
    s.find(friction);
    return s;
}

}  // namespace

TEST_CASE("a contact's impulses keep linear and angular momentum") {
    System s = heap(60, 0.3, 1);
    REQUIRE(s.contacts.size() > 20);
    std::mt19937 random(8);
    std::normal_distribution<double> normal;
    double linear = 0, angular = 0;
    std::size_t joined = 0;
    for (std::size_t c = 0; c < s.laws.size(); ++c) {
        // Points far aside of each other at x_t have no common point: see place_contact.
        const bool common = length(s.common_point(c, 0) - s.common_point(c, 1)) < 1e-12;
        joined += common;
        const double p[3] = {normal(random), normal(random), normal(random)};
        std::vector<double> impulse(s.numbers(), 0.0);
        for (std::uint32_t side = 0; side < s.laws[c].sides; ++side)
            add_impulse(s.laws[c].rows[side], p, impulse);
        Vector3 sum(0.0), moment(0.0);
        double arm = 0;
        for (std::size_t i = 0; i < s.chains.x_t0.size(); ++i) {
            const Vector3 q{impulse[4 * i], impulse[4 * i + 1], impulse[4 * i + 2]};
            sum += q;
            moment += cross(s.chains.x_t0[i], q);
            arm = std::max(arm, length(s.chains.x_t0[i]) * length(q));
            if (impulse[4 * i + 3] != 0) {
                const Vector3 e = s.chains.x_t0[i + 1] - s.chains.x_t0[i];
                moment += e * (impulse[4 * i + 3] / length(e));
            }
        }
        const double size = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        linear = std::max(linear, length(sum) / size);
        if (common) angular = std::max(angular, length(moment) / arm);
    }
    INFO("linear " << linear << ", angular " << angular << " of " << joined << " contacts");
    CHECK(joined > 20);
    CHECK(linear < 1e-12);
    CHECK(angular < 1e-12);
}

TEST_CASE("without arms the friction of two strands leaves a torque") {
    System s = heap(60, 0.3, 1);
    double angular = 0;
    for (std::size_t c = 0; c < s.contacts.size(); ++c) {
        Contact plain = s.contacts[c];
        plain.arm[0] = plain.arm[1] = Vector3(0);
        std::vector<double> impulse(s.numbers(), 0.0);
        const double p[3] = {0, 1, 0};
        for (int side = 0; side < 2; ++side)
            add_impulse(
                make_rows(s.chains.view(), plain, side, s.frames[c], s.laws[c].rows[side].first, 1),
                p, impulse);
        Vector3 moment(0.0);
        for (std::size_t i = 0; i < s.chains.x_t0.size(); ++i)
            moment += cross(s.chains.x_t0[i],
                            Vector3(impulse[4 * i], impulse[4 * i + 1], impulse[4 * i + 2]));
        angular = std::max(angular, length(moment));
    }
    CHECK(angular > 1e-5);
}

TEST_CASE("repeated local impulses reach the Coulomb law for either inertia") {
    for (const double friction : {0.0, 0.3, 1.0})
        for (const LocalInertia inertia : {LocalInertia::lumped, LocalInertia::rigid}) {
            System s = heap(60, friction, 2);
            const std::vector<double> free = s.free_velocity();
            std::vector<double> impulses(3 * s.laws.size(), 0.0), v = free;
            ImpulsePass pass;
            const double before = s.residual(v, impulses);
            for (int k = 0; k < 4000; ++k) {
                pass.run(s.laws, v, s.inverse_mass, inertia, 1, impulses);
                v = s.velocity(free, impulses);
            }
            const double f = s.residual(v, impulses);
            INFO("friction " << friction << ", residual before " << before << ", after " << f);
            CHECK(before > 1e-3);
            CHECK(f < 1e-7);
        }
}

TEST_CASE("impulses take no energy from nowhere") {
    System s = heap(60, 0.3, 3);
    const std::vector<double> free = s.free_velocity();
    std::vector<double> impulses(3 * s.laws.size(), 0.0), v = free;
    ImpulsePass pass;
    for (int k = 0; k < 4000; ++k) {
        pass.run(s.laws, v, s.inverse_mass, LocalInertia::lumped, 1, impulses);
        v = s.velocity(free, impulses);
    }
    auto energy = [&](const std::vector<double>& w) {
        double e = 0;
        for (std::size_t i = 0; i < w.size(); ++i) e += 0.5 * w[i] * w[i] / s.inverse_mass[i];
        return e;
    };
    CHECK(energy(v) < energy(free));
}

TEST_CASE("a vertex on a plane under gravity is stopped in one pass") {
    System s;
    s.chains.add({{0, r, 0}, {0.01, r, 0}}, {0, -9.81 * step * step, 0}, r);
    s.find(0.3, {MovingShape{{ShapeKind::plane, {0, 0, 0}, {0, 1, 0}, 0, nullptr}, {}, {}}});
    REQUIRE(s.laws.size() == 2);
    const std::vector<double> free = s.free_velocity();
    std::vector<double> impulses(6, 0.0);
    ImpulsePass pass;
    pass.run(s.laws, free, s.inverse_mass, LocalInertia::lumped, 1, impulses);
    CHECK(impulses[0] == Approx(mass * 9.81 * step));
    const std::vector<double> v = s.velocity(free, impulses);
    CHECK(std::fabs(v[1]) < 1e-15);
}
