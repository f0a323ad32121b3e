#include "runtime/contact/gauss_seidel.h"

#include "runtime/contact/coulomb.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace keratin;

namespace {

// Strands of given vertex counts in blocks of `lanes`, each with a dense random positive definite
// matrix of 4 n numbers and its inverse.
class RandomRods final : public RodInverse {
  public:
    std::vector<std::uint32_t> first, vertex_count, block, block_first;
    std::uint32_t lanes;
    std::vector<std::vector<double>> inverse;  // [strand][n * n]

    RandomRods(std::vector<std::uint32_t> counts, std::uint32_t lane_count, unsigned seed)
        : vertex_count(std::move(counts)), lanes(lane_count) {
        std::mt19937 random(seed);
        std::normal_distribution<double> normal;
        block_first.push_back(0);
        for (std::size_t s = 0; s < vertex_count.size(); ++s) {
            const std::size_t lane = s % lanes;
            if (lane == 0) {
                std::uint32_t most = 0;
                for (std::size_t t = s; t < std::min<std::size_t>(s + lanes, vertex_count.size());
                     ++t)
                    most = std::max(most, vertex_count[t]);
                block_first.push_back(block_first.back() + 4 * most * lanes);
            }
            block.push_back(static_cast<std::uint32_t>(block_first.size() - 2));
            first.push_back(block_first[block.back()] + static_cast<std::uint32_t>(lane));
            // inverse = B B^T + 1: positive definite.
            const std::size_t n = 4 * vertex_count[s];
            std::vector<double> b(n * n), w(n * n);
            for (double& x : b) x = normal(random) / std::sqrt(static_cast<double>(n));
            for (std::size_t i = 0; i < n; ++i)
                for (std::size_t j = 0; j < n; ++j) {
                    double sum = i == j ? 0.3 : 0;
                    for (std::size_t k = 0; k < n; ++k) sum += b[i * n + k] * b[j * n + k];
                    w[i * n + j] = sum;
                }
            inverse.push_back(w);
        }
    }

    RodLayout layout() const { return {first, vertex_count, block, block_first, lanes}; }

    std::uint64_t version(std::uint32_t) const override { return 1; }
    void apply_block(std::uint32_t b, std::size_t before, std::span<double> values) const override {
        CHECK(
            std::ranges::all_of(values.first(3 * before * lanes), [](double x) { return x == 0; }));
        for (std::size_t s = 0; s < first.size(); ++s) {
            if (block[s] != b) continue;
            for (std::size_t c = 0; c < 3; ++c)
                apply(s,
                      &values[3 * (first[s] - block_first[b] - s % lanes) + s % lanes + c * lanes],
                      3 * lanes);
        }
        std::ranges::fill(values.first(3 * before * lanes), 0.0);
    }
    // One strand, in place; its numbers stand `apart`.
    void apply(std::size_t s, double* values, std::size_t apart) const {
        const std::size_t n = 4 * vertex_count[s];
        std::vector<double> y(n, 0.0);
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j) y[i] += inverse[s][i * n + j] * values[j * apart];
        for (std::size_t i = 0; i < n; ++i) values[i * apart] = y[i];
    }
};

struct Scene {
    RandomRods rods;
    std::vector<ContactLaw> laws;
    std::vector<SidePlace> places;
    std::vector<double> v;

    Scene(std::vector<std::uint32_t> counts, std::size_t contacts, unsigned seed)
        : rods(std::move(counts), 4, seed) {
        std::mt19937 random(seed + 1);
        std::normal_distribution<double> normal;
        const RodLayout layout = rods.layout();
        v.resize(layout.number_count());
        for (double& x : v) x = normal(random);
        for (std::size_t c = 0; c < contacts; ++c) {
            ContactLaw law{};
            law.sides = c % 5 == 0 ? 1 : 2;
            law.friction = c % 7 == 0 ? 0.0 : 0.3;
            for (double& x : law.constant) x = 0.3 * normal(random);
            for (std::uint32_t side = 0; side < 2; ++side) {
                SidePlace place{static_cast<std::uint32_t>(random() % layout.first.size()), 0};
                if (c % 11 == 0 && side == 1) place.strand = places.back().strand;
                place.vertex =
                    static_cast<std::uint32_t>(random() % (layout.vertex_count[place.strand] - 1));
                law.rows[side].first =
                    static_cast<std::uint32_t>(layout.index(place.strand, place.vertex, 0));
                law.rows[side].stride = layout.lanes;
                for (auto& row : law.rows[side].weight)
                    for (double& w : row) w = normal(random);
                places.push_back(place);
            }
            laws.push_back(law);
        }
    }

    GaussSeidelSettings settings(int threads) const {
        GaussSeidelSettings s;
        s.threads = threads;
        s.velocity_scale = 1;
        s.impulse_scale = 1;
        s.most_sweeps = 2000;
        s.residual = s.accepted = 1e-9;
        return s;
    }

    // v + W r, with W applied by the rods' inverse and not by the solver's own blocks.
    std::vector<double> velocities(const std::vector<double>& impulses) const {
        const RodLayout layout = rods.layout();
        std::vector<double> w(v.size(), 0.0);
        for (std::size_t c = 0; c < laws.size(); ++c)
            for (std::uint32_t side = 0; side < laws[c].sides; ++side)
                add_impulse(laws[c].rows[side], &impulses[3 * c], w);
        for (std::size_t s = 0; s < layout.first.size(); ++s)
            rods.apply(s, &w[layout.first[s]], layout.lanes);
        for (std::size_t i = 0; i < w.size(); ++i) w[i] += v[i];
        return w;
    }

    // mean |f_FB| there.
    double residual(const std::vector<double>& impulses) const {
        const std::vector<double> w = velocities(impulses);
        double sum = 0;
        for (std::size_t c = 0; c < laws.size(); ++c) {
            double u[3];
            relative_velocity(laws[c], w, u);
            const double* r = &impulses[3 * c];
            sum += coulomb_residual(Local3<Double1>{r[0], r[1], r[2]},
                                    Local3<Double1>{u[0], u[1], u[2]}, Double1(laws[c].friction))
                       .v;
        }
        return sum / static_cast<double>(laws.size());
    }
};

}  // namespace

TEST_CASE("Gauss-Seidel on the true operator reaches the Coulomb law") {
    for (const std::size_t contacts : {1, 7, 60}) {
        Scene s(std::vector<std::uint32_t>(23, 6), contacts, 40);
        std::vector<double> impulses(3 * contacts, 0.0), none(3 * contacts, 0.0);
        GaussSeidel solver;
        solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 1);
        const GaussSeidelReport report = solver.solve(s.laws, s.v, none, s.settings(1), impulses);
        INFO(contacts << " contacts, " << report.sweeps << " sweeps, residual " << report.residual);
        CHECK(report.residual < 1e-9);
        CHECK(s.residual(std::vector<double>(3 * contacts, 0.0)) > 1e-2);
        CHECK(s.residual(impulses) < 1e-7);  // the solver's W is kept in floats
        // What they lack, a pass that starts from the velocities of these impulses makes good.
        std::vector<double> again = impulses;
        solver.solve(s.laws, s.velocities(impulses), impulses, s.settings(1), again);
        CHECK(s.residual(again) < 1e-8);
    }
}

TEST_CASE("contacts that nearly repeat each other do not slow the solve down") {
    // Every contact twice, the second a little beside the first: sweeps alone share the load
    // between them at a rate of the square of that little.
    Scene s(std::vector<std::uint32_t>(23, 6), 20, 43);
    std::mt19937 random(44);
    std::normal_distribution<double> normal;
    for (std::size_t c = 0; c < 20; ++c) {
        ContactLaw law = s.laws[c];
        for (std::uint32_t side = 0; side < 2; ++side) {
            for (auto& row : law.rows[side].weight)
                for (double& w : row) w += 0.003 * normal(random);
            s.places.push_back(s.places[2 * c + side]);
        }
        law.constant[0] += 0.001 * normal(random);
        s.laws.push_back(law);
    }
    std::vector<double> impulses(120, 0.0), none(120, 0.0);
    GaussSeidel solver;
    solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 1);
    GaussSeidelSettings settings = s.settings(1);
    settings.residual = 1e-8;
    const GaussSeidelReport report = solver.solve(s.laws, s.v, none, settings, impulses);
    INFO(report.sweeps << " sweeps, residual " << report.residual);
    CHECK(s.residual(impulses) < 1e-7);
    CHECK(report.sweeps <= 60);  // 28, and 124 by sweeps alone
}

TEST_CASE("strands with more contacts than numbers are solved over their velocities") {
    Scene s({4, 5, 40, 3}, 40, 41);
    std::vector<double> impulses(120, 0.0), none(120, 0.0);
    GaussSeidel solver;
    solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 1);
    GaussSeidelSettings settings = s.settings(1);
    settings.most_sweeps = 20000;
    const GaussSeidelReport report = solver.solve(s.laws, s.v, none, settings, impulses);
    INFO(report.sweeps << " sweeps, residual " << report.residual);
    CHECK(s.residual(impulses) < 1e-6);
    CHECK(s.residual(impulses) == Approx(report.residual).margin(1e-7));
}

TEST_CASE("what is taken over from the W before is what a new W would have") {
    Scene scene({8, 6, 9, 12, 5, 7}, 40, 77);
    const GaussSeidelSettings settings = scene.settings(1);
    GaussSeidel kept;
    kept.assemble(scene.rods.layout(), scene.laws, scene.places, scene.rods, 1);
    // One contact fewer, one moved: the strands of neither stay as they were.
    scene.laws.erase(scene.laws.begin() + 3);
    scene.places.erase(scene.places.begin() + 6, scene.places.begin() + 8);
    scene.laws[9].rows[0].weight[1][4] += 0.25;
    kept.assemble(scene.rods.layout(), scene.laws, scene.places, scene.rods, 1);
    GaussSeidel made;
    made.assemble(scene.rods.layout(), scene.laws, scene.places, scene.rods, 1);
    std::vector<double> r(3 * scene.laws.size(), 0.0), q(r);
    const std::vector<double> none(r);
    kept.solve(scene.laws, scene.v, none, settings, r);
    made.solve(scene.laws, scene.v, none, settings, q);
    CHECK(r == q);
    CHECK(scene.residual(r) <= 1e-6);
}

TEST_CASE("all contacts of a strand together come to the same solution as one after the other") {
    const Scene scene({24, 20, 30, 28, 26}, 24, 31);
    const GaussSeidelSettings settings = scene.settings(1);
    GaussSeidel solver;
    solver.assemble(scene.rods.layout(), scene.laws, scene.places, scene.rods, 1, true);
    std::vector<double> swept(3 * scene.laws.size(), 0.0), together(swept);
    const std::vector<double> none(swept);
    solver.solve(scene.laws, scene.v, none, settings, swept);
    const GaussSeidelReport report =
        solver.solve_strands(scene.laws, scene.places, scene.v, none, settings, together);
    CHECK(report.residual <= settings.residual);
    CHECK(scene.residual(together) <= 2 * settings.residual);
    CHECK(report.sweeps < 40);
    const std::vector<double> u = scene.velocities(swept), v = scene.velocities(together);
    for (std::size_t i = 0; i < u.size(); ++i) CHECK(v[i] == Approx(u[i]).margin(1e-5));
}

TEST_CASE("impulses that the velocity does not contain yet are accounted for") {
    Scene s(std::vector<std::uint32_t>(23, 6), 30, 42);
    std::vector<double> first(90, 0.0), none(90, 0.0);
    GaussSeidel solver;
    solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 1);
    solver.solve(s.laws, s.v, none, s.settings(1), first);
    std::vector<double> second = first;
    const GaussSeidelReport report = solver.solve(s.laws, s.v, none, s.settings(1), second);
    CHECK(report.change < 1e-7);
}

TEST_CASE("the Gauss-Seidel solution is the same for any number of threads") {
    Scene s(std::vector<std::uint32_t>(50, 8), 200, 43);
    std::vector<double> none(600, 0.0), one(600, 0.0), two(600, 0.0);
    GaussSeidel solver;
    GaussSeidelSettings settings = s.settings(1);
    settings.most_sweeps = 30;
    solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 1);
    solver.solve(s.laws, s.v, none, settings, one);
    settings.threads = 3;
    solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 3);
    solver.solve(s.laws, s.v, none, settings, two);
    CHECK(one == two);
}

TEST_CASE("wide and narrow instruction sets agree to rounding") {
    Scene s(std::vector<std::uint32_t>(30, 6), 60, 44);
    std::vector<double> none(180, 0.0), wide(180, 0.0), narrow(180, 0.0);
    GaussSeidel solver;
    GaussSeidelSettings settings = s.settings(1);
    settings.most_sweeps = 8;
    solver.assemble(s.rods.layout(), s.laws, s.places, s.rods, 1);
    solver.solve(s.laws, s.v, none, settings, wide);
    settings.instruction_set = InstructionSet::baseline;
    solver.solve(s.laws, s.v, none, settings, narrow);
    double difference = 0;
    for (std::size_t i = 0; i < wide.size(); ++i)
        difference = std::max(difference, std::fabs(wide[i] - narrow[i]));
    CHECK(difference < 1e-9);
}
