// The whole objective of a step against finite differences: inertia, drag and springs (in weight and
// target), stretch, bend and twist with elliptic sections and rest values (where viscosity goes as
// well), clamps at both ends, strands of different lengths side by side.
#include "runtime/rod/rod_pass.h"

#include "runtime/rod/rod_blocks.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

using namespace keratin;

namespace {

constexpr std::size_t kVertices = 7;
constexpr double kStep = 0.4;  // s: positions and velocities are all about 1

struct Problem {
    const RodPasses& passes = rod_passes(InstructionSet::automatic);
    std::size_t lanes = passes.lanes;
    AlignedDoubles x, v, v_t0, weight, target, edges, joints, ends, edge_count, spin, frames;
    std::vector<std::uint8_t> free_lanes;
    RodBlock block;
    std::mt19937_64 random{11};

    double uniform(double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53; }

    // The direction of edge i at the end of the step, about.
    explicit Problem(const std::function<Double3(Problem&, std::size_t)>& way) {
        const std::size_t numbers = 4 * kVertices * lanes;
        for (AlignedDoubles* a : {&x, &v, &v_t0, &weight, &target}) *a = AlignedDoubles(numbers);
        edges = AlignedDoubles(kVertices * kRodEdge * lanes);
        joints = AlignedDoubles(kVertices * kRodJoint * lanes);
        frames = AlignedDoubles(kVertices * kRodFrame * lanes);
        ends = AlignedDoubles(12 * lanes);
        edge_count = AlignedDoubles(lanes);
        spin = AlignedDoubles(lanes);
        free_lanes.assign(4 * kVertices, static_cast<std::uint8_t>((1u << lanes) - 1));
        for (std::size_t l = 0; l < lanes; ++l) {
            const std::size_t count = kVertices - 1 - l % 3;
            edge_count[l] = static_cast<double>(count);
            Double3 at{0, 0, 0};
            for (std::size_t i = 0; i < kVertices; ++i) {
                const Double3 d = way(*this, i);
                for (std::size_t c = 0; c < 4; ++c) {
                    const std::size_t k = (4 * i + c) * lanes + l;
                    v[k] = uniform(-1, 1);
                    x[k] = (c < 3 ? at[c] : uniform(-2, 2)) - kStep * v[k];
                    v_t0[k] = uniform(-1, 1);
                    weight[k] = uniform(0.5, 2);
                    target[k] = uniform(-1, 1);
                }
                for (std::size_t c = 0; c < 3; ++c) at[c] += d[c];
                const bool real = i < count;
                edges[(i * kRodEdge) * lanes + l] = real ? uniform(1, 3) : 0;
                edges[(i * kRodEdge + 1) * lanes + l] = uniform(0.7, 1.2);
                for (std::size_t c = 0; c < kRodJoint; ++c)
                    joints[(i * kRodJoint + c) * lanes + l] = i > count ? 0 : c < 3 ? uniform(0.3, 2) : uniform(-0.5, 0.5);
                frames[(i * kRodFrame) * lanes + l] = 1;
                frames[(i * kRodFrame + 4) * lanes + l] = 1;
            }
            for (const std::size_t c : {0, 4, 6, 10}) ends[c * lanes + l] = 1;
            // clamps hold the ends' points
            for (std::size_t c = 0; c < 3; ++c)
                for (const std::size_t i : {std::size_t{0}, count})
                    free_lanes[4 * i + c] &= static_cast<std::uint8_t>(~(1u << l));
        }
        block.vertex_count = kVertices;
        block.min_edge_count = kVertices - 3;
        block.step = kStep;
        block.edge_count = edge_count.data();
        block.spin_weight = spin.data();
        block.x_t0 = x.data();
        block.v_t0 = v_t0.data();
        block.weight = weight.data();
        block.target = target.data();
        block.edges = edges.data();
        block.joints = joints.data();
        block.ends = ends.data();
        block.free_lanes = free_lanes.data();
        // based where the derivatives are taken
        frames = evaluate(v).frames;
    }

    struct Value {
        AlignedDoubles energy, gradient, frames;
    };
    Value evaluate(const AlignedDoubles& at) const {
        const std::size_t numbers = 4 * kVertices * lanes;
        Value out{AlignedDoubles(lanes), AlignedDoubles(numbers), AlignedDoubles(kVertices * kRodFrame * lanes)};
        AlignedDoubles none(numbers), alpha(lanes), v_try(numbers), scale(lanes), slope(lanes);
        passes.evaluate(block, at.data(), none.data(), alpha.data(), frames.data(), v_try.data(), out.frames.data(),
                        out.gradient.data(), out.energy.data(), scale.data(), slope.data());
        return out;
    }
    AlignedDoubles moved(std::size_t row, double by) const {
        AlignedDoubles out(v.size());
        std::copy_n(v.data(), v.size(), out.data());
        for (std::size_t l = 0; l < lanes; ++l) out[row * lanes + l] += by;
        return out;
    }
    // A number that the strand has and that is not prescribed.
    bool real(std::size_t row, std::size_t l) const {
        const double i = static_cast<double>(row / 4);
        return i < edge_count[l] && (row % 4 == 3 || i > 0);
    }
};

struct Worst {
    double gradient = 0, hessian = 0;
};

Worst compare(const std::function<Double3(Problem&, std::size_t)>& way, double by) {
    const Problem p(way);
    constexpr std::size_t rows = 4 * kVertices;
    const AlignedDoubles gradient = p.evaluate(p.v).gradient;
    AlignedDoubles exact(p.lanes), band((rows + 2 * kRodPadRows) * kRodBandWidth * p.lanes);
    std::fill_n(exact.data(), p.lanes, 1.0);
    double* first = band.data() + kRodPadRows * kRodBandWidth * p.lanes;
    p.passes.assemble(p.block, p.v.data(), p.frames.data(), exact.data(), first);
    std::vector<std::vector<double>> slope(rows, std::vector<double>(rows * p.lanes));
    Worst worst;
    std::vector<double> largest(p.lanes), steepest(p.lanes), off(p.lanes);
    for (std::size_t c = 0; c < rows; ++c) {
        const Problem::Value plus = p.evaluate(p.moved(c, by)), minus = p.evaluate(p.moved(c, -by));
        for (std::size_t l = 0; l < p.lanes; ++l) {
            if (!p.real(c, l)) continue;
            const double g = (plus.energy[l] - minus.energy[l]) / (2 * by);
            off[l] = std::max(off[l], std::fabs(g - gradient[c * p.lanes + l]));
            largest[l] = std::max(largest[l], std::fabs(g));
            for (std::size_t r = 0; r < rows; ++r)
                slope[r][c * p.lanes + l] = (plus.gradient[r * p.lanes + l] - minus.gradient[r * p.lanes + l]) / (2 * by);
        }
    }
    std::vector<double> bent(p.lanes);
    for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t c = 0; c <= r; ++c)
            for (std::size_t l = 0; l < p.lanes; ++l) {
                if (!p.real(r, l) || !p.real(c, l)) continue;
                const double found = (slope[r][c * p.lanes + l] + slope[c][r * p.lanes + l]) / 2;
                const double have = r - c > kRodHalfBand ? 0 : first[(r * kRodBandWidth + kRodHalfBand - (r - c)) * p.lanes + l];
                bent[l] = std::max(bent[l], std::fabs(found - have));
                steepest[l] = std::max(steepest[l], std::fabs(found));
            }
    for (std::size_t l = 0; l < p.lanes; ++l) {
        worst.gradient = std::max(worst.gradient, off[l] / largest[l]);
        worst.hessian = std::max(worst.hessian, bent[l] / steepest[l]);
    }
    UNSCOPED_INFO("gradient off by " << worst.gradient << ", Hessian by " << worst.hessian);
    return worst;
}

Double3 random_way(Problem& p, std::size_t) { return {p.uniform(-1, 1), p.uniform(-1, 1), p.uniform(0.2, 1)}; }
Double3 straight_way(Problem& p, std::size_t) { return {1, p.uniform(-1e-4, 1e-4), p.uniform(-1e-4, 1e-4)}; }
// each edge almost back along the one before; the first as the root's clamp wants it
Double3 folded_way(Problem& p, std::size_t i) { return {i % 2 ? -1.0 : 1.0, p.uniform(0.05, 0.1), p.uniform(-0.1, -0.05)}; }

}  // namespace

TEST_CASE("a step's gradient and Hessian agree with finite differences at random states") {
    const Worst worst = compare(random_way, 1e-5);
    CHECK(worst.gradient < 1e-6);
    CHECK(worst.hessian < 1e-5);
}
TEST_CASE("a step's gradient and Hessian agree with finite differences at nearly straight states") {
    const Worst worst = compare(straight_way, 1e-5);
    CHECK(worst.gradient < 1e-6);
    CHECK(worst.hessian < 1e-5);
}
TEST_CASE("a step's gradient and Hessian agree with finite differences at nearly folded states") {
    const Worst worst = compare(folded_way, 1e-6);
    CHECK(worst.gradient < 1e-6);
    CHECK(worst.hessian < 1e-5);
}

TEST_CASE("an impulse that is not a number is felt by its own strand alone") {
    Problem p([](Problem&, std::size_t) { return Double3{1, 0, 0}; });
    const std::size_t row = 4 * 2 + 1;
    AlignedDoubles change(p.v.size()), gradient(p.v.size()), energy(p.lanes), scale(p.lanes);
    change[row * p.lanes] = std::numeric_limits<double>::quiet_NaN();
    if (p.lanes > 2) p.v[row * p.lanes + 2] = std::numeric_limits<double>::infinity();
    const std::uint32_t pushed = p.passes.push(p.block, change.data(), p.v.data(), p.target.data(),
                                               gradient.data(), energy.data(), scale.data());
    CHECK(pushed == 1);
    CHECK(std::isnan(gradient[row * p.lanes]));
    CHECK(std::isnan(energy[0]));
    for (std::size_t l = 1; l < p.lanes; ++l) CHECK(energy[l] == 0);
}
