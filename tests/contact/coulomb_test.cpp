#include "runtime/contact/coulomb.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <random>

using namespace keratin;

namespace {

Local3<Double1> local(double n, double t1, double t2) { return {n, t1, t2}; }

// A random positive definite 3 x 3 matrix with eigenvalues over about three decades.
Delassus<Double1> random_operator(std::mt19937& random) {
    std::normal_distribution<double> normal;
    double a[3][3], w[3][3] = {};
    for (auto& row : a) {
        const double scale = std::exp(1.7 * normal(random));
        for (double& x : row) x = scale * normal(random);
    }
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) w[i][j] += a[k][i] * a[k][j];
            if (i == j) w[i][j] += 1e-2;
        }
    return {w[0][0], w[0][1], w[0][2], w[1][1], w[1][2], w[2][2]};
}

}  // namespace

TEST_CASE("the Coulomb residual has the values of the reference vectors") {
    const nlohmann::json reference =
        nlohmann::json::parse(std::ifstream(KERATIN_DATA_DIR "/validation/contact_reference.json"));
    std::size_t count = 0;
    for (const auto& v : reference.at("fb_vectors")) {
        const double f =
            coulomb_residual(local(v["r"][0], v["r"][1], v["r"][2]),
                             local(v["u"][0], v["u"][1], v["u"][2]), Double1(v["mu"].get<double>()))
                .v;
        INFO(v["name"]);
        CHECK(f == Approx(v["residual"].get<double>()).margin(1e-8));
        CHECK((f < 1e-7) == v["satisfies"].get<bool>());
        ++count;
    }
    CHECK(count == 14);
}

TEST_CASE("the solution of one contact satisfies the Coulomb law") {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    int open = 0, stick = 0, slip = 0;
    double worst = 0, worst_opening = 0, worst_direction = 0;
    for (int i = 0; i < 20000; ++i) {
        const Delassus<Double1> w = random_operator(random);
        const Local3<Double1> b = local(normal(random), normal(random), normal(random));
        const double friction[] = {0.0, 0.1, 0.3, 1.0, 10.0, kMostFriction};
        const double mu = friction[i % 6];
        // Wherever the search begins.
        const Local3<Double1> near =
            i % 2 == 0 ? local(0, 0, 0) : local(normal(random), normal(random), normal(random));
        const Local3<Double1> r = solve_one_contact(w, b, Double1(mu), near);
        const Local3<Double1> u{w.nn * r.n + w.n1 * r.t1 + w.n2 * r.t2 + b.n,
                                w.n1 * r.n + w.t11 * r.t1 + w.t12 * r.t2 + b.t1,
                                w.n2 * r.n + w.t12 * r.t1 + w.t22 * r.t2 + b.t2};
        const double rt = std::hypot(r.t1.v, r.t2.v), ut = std::hypot(u.t1.v, u.t2.v);
        const double scale = 1 + std::fabs(r.n.v) * (w.nn.v + w.t11.v + w.t22.v);
        REQUIRE(r.n.v >= 0);
        if (r.n.v == 0) {
            ++open;
            CHECK(u.n.v >= 0);
            CHECK(rt == 0);
            continue;
        }
        worst = std::max(worst, (rt - mu * r.n.v) / (1 + mu * r.n.v));
        worst_opening = std::max(worst_opening, std::fabs(u.n.v) / scale);
        if (rt < mu * r.n.v * (1 - 1e-9) || mu == 0) {
            if (mu > 0) {
                ++stick;
                worst_direction = std::max(worst_direction, ut / scale);
            }
        } else {
            ++slip;
            const double along = r.t1.v * u.t1.v + r.t2.v * u.t2.v;
            worst_direction = std::max(worst_direction, (along + rt * ut) / (scale * (1 + rt)));
        }
    }
    CHECK(open > 3000);
    CHECK(stick > 1000);
    CHECK(slip > 1000);
    INFO("cone " << worst << ", normal " << worst_opening << ", direction " << worst_direction);
    CHECK(worst < 1e-12);
    CHECK(worst_opening < 1e-8);
    CHECK(worst_direction < 1e-10);
}

TEST_CASE("a sliding contact that does not press, or hardly, has a finite impulse in the cone") {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 200; ++i) {
        const Delassus<Double1> w = random_operator(random);
        for (const double push : {0.0, 1e-310, 1e-300, 1e-200}) {
            const Local3<Double1> b = local(-push, 1e12 * normal(random), 1e12 * normal(random));
            const Local3<Double1> r = solve_one_contact(w, b, Double1(0.3));
            INFO(i << ", push " << push);
            REQUIRE(std::isfinite(r.n.v));
            CHECK(std::hypot(r.t1.v, r.t2.v) <= 0.3 * r.n.v * (1 + 1e-9) + 1e-290);
        }
    }
}
