#include "runtime/lane/instruction_set.h"
#include "tests/agree/formulas.h"

#include <catch2/catch.hpp>

#include <bit>
#include <random>
#include <vector>

#define DECLARE(isa)                                        \
    namespace keratin::isa {                                \
    int lanes();                                            \
    void evaluate_lanes(int formula, const float*, float*); \
    }
DECLARE(baseline)
#if defined(__x86_64__)
DECLARE(avx2)
DECLARE(avx512)
#endif

using namespace keratin;
using namespace keratin::agree;

namespace {

struct Lanes {
    const char* name;
    InstructionSet set;
    int lanes;
    void (*evaluate)(int, const float*, float*);
};

std::vector<Lanes> all_lanes() {
    std::vector<Lanes> all{
        {"baseline", InstructionSet::baseline, baseline::lanes(), baseline::evaluate_lanes}};
#if defined(__x86_64__)
    if (usable_instruction_set(InstructionSet::avx2) == InstructionSet::avx2)
        all.push_back({"avx2", InstructionSet::avx2, avx2::lanes(), avx2::evaluate_lanes});
    if (usable_instruction_set(InstructionSet::avx512) == InstructionSet::avx512)
        all.push_back({"avx512", InstructionSet::avx512, avx512::lanes(), avx512::evaluate_lanes});
#endif
    return all;
}

// Numbers between -2 and 2, with zeros and equal vectors among them.
std::vector<float> inputs(std::size_t items, unsigned seed) {
    std::mt19937 engine(seed);
    std::vector<float> v(items * kInputs);
    for (float& x : v) {
        const auto bits = engine();
        x = bits % 97 == 0 ? 0.0f : float(bits >> 8) * 0x1p-22f - 2.0f;
    }
    for (std::size_t i = 0; i < items; i += 50)
        for (std::size_t k = 0; k < 3; ++k) {
            v[i * kInputs + 3 + k] = (i % 100 ? -1.0f : 1.0f) * v[i * kInputs + k];
        }
    return v;
}

constexpr std::size_t kItems = 6400;

}  // namespace

TEST_CASE("every formula gives the same bits in scalars and in lanes of every instruction set") {
    const std::vector<float> in = inputs(kItems, 11);
    for (const Lanes& lanes : all_lanes()) {
        const auto w = std::size_t(lanes.lanes);
        std::vector<float> x(w * kInputs), y(w * kOutputs);
        for (int f = 0; f < formula_count; ++f) {
            INFO(lanes.name << ": " << agree::name_of(f));
            std::size_t different = 0;
            for (std::size_t first = 0; first + w <= kItems; first += w) {
                for (std::size_t l = 0; l < w; ++l)
                    for (std::size_t i = 0; i < kInputs; ++i)
                        x[i * w + l] = in[(first + l) * kInputs + i];
                lanes.evaluate(f, x.data(), y.data());
                for (std::size_t l = 0; l < w; ++l) {
                    float expected[kOutputs];
                    evaluate<float>(f, &in[(first + l) * kInputs], expected);
                    for (std::size_t o = 0; o < kOutputs; ++o) {
                        const float got = y[o * w + l];
                        const bool both_nan = got != got && expected[o] != expected[o];
                        different += !both_nan && std::bit_cast<std::uint32_t>(got) !=
                                                      std::bit_cast<std::uint32_t>(expected[o]);
                    }
                }
            }
            CHECK(different == 0);
        }
    }
}

TEST_CASE("every formula in float is near the same formula in double") {
    const std::vector<float> in = inputs(kItems, 12);
    for (int f = 0; f < formula_count; ++f) {
        std::vector<double> errors;
        for (std::size_t item = 0; item < kItems; ++item) {
            double x[kInputs], exact[kOutputs];
            float got[kOutputs];
            for (int i = 0; i < kInputs; ++i) x[i] = double(in[item * kInputs + std::size_t(i)]);
            evaluate<float>(f, &in[item * kInputs], got);
            evaluate<double>(f, x, exact);
            double worst = 0, scale = 1;
            for (int o = 0; o < kOutputs; ++o) {
                scale = std::max(scale, std::fabs(exact[o]));
                worst = std::max(worst, std::fabs(double(got[o]) - exact[o]));
            }
            errors.push_back(worst / scale);
        }
        // Where a formula chooses (nearest face, shorter way round, a fallback), rounding may
        // choose the other: at most one item in a hundred.
        std::nth_element(errors.begin(), errors.begin() + kItems * 99 / 100, errors.end());
        INFO(agree::name_of(f) << ": " << errors[kItems * 99 / 100]);
        CHECK(errors[kItems * 99 / 100] < 1e-4);
    }
}

TEST_CASE("minimal rotation takes one direction to the other and keeps lengths") {
    const std::vector<float> in = inputs(kItems, 13);
    for (std::size_t item = 0; item < kItems; ++item) {
        const auto v = [&](std::size_t i) {
            const float* p = &in[item * kInputs + 3 * i];
            return Vec3<double>(double(p[0]), double(p[1]), double(p[2]));
        };
        const Vec3<double> z(0, 0, 1);
        const auto a = normalize_or(v(0), z), b = normalize_or(v(1), z);
        const auto axis = any_perpendicular(a);
        const auto turned = minimal_rotation(a, b, axis, a);
        REQUIRE(length(turned - b) < 3e-4);  // within the guard about opposite directions
        const auto w = minimal_rotation(a, b, axis, v(2));
        REQUIRE(length(w) == Approx(length(v(2))).margin(1e-6));
        const auto u = transport_director(a, b, axis);
        REQUIRE(dot(u, b) == Approx(0).margin(1e-12));
        if (dot(a, b) > -0.999) REQUIRE(length(u - minimal_rotation(a, b, axis, axis)) < 1e-9);
    }
}

TEST_CASE("the reaction of a bend is the derivative of its error") {
    // (dg/da)^T y against finite differences of y . g over the parent's edge, y along g apart: g
    // keeps its length.
    const std::vector<float> in = inputs(400, 14);
    int tested = 0;
    for (std::size_t item = 0; item < 400; ++item) {
        const auto v = [&](std::size_t i) {
            const float* p = &in[item * kInputs + 3 * i];
            return Vec3<double>(double(p[0]), double(p[1]), double(p[2]));
        };
        const Vec3<double> a = v(0), d = v(1), y = v(2), z(0, 0, 1);
        const auto r = normalize_or(v(3), z), t = normalize_or(a, z);
        if (length(a) < 0.3 || dot(r, t) < -0.85) continue;
        const double along = dot(r, d), inverse = bend_inverse(r, t);
        const auto g = bend_target(r, t, d, along, inverse);
        const auto reaction = bend_reaction(r, t, g, y, along, inverse, 1 / length(a));
        const double step = 1e-6;
        for (int c = 0; c < 3; ++c) {
            const auto target = [&](double s) {
                Vec3<double> e = a;
                (c == 0 ? e.x : c == 1 ? e.y : e.z) += s;
                return minimal_rotation(r, normalize_or(e, z), any_perpendicular(r), d);
            };
            const double slope = dot(y, target(step) - target(-step)) / (2 * step);
            const double expected = c == 0 ? reaction.x : c == 1 ? reaction.y : reaction.z;
            REQUIRE(slope == Approx(expected).margin(1e-6 * (1 + length(y) * length(d))));
        }
        ++tested;
    }
    CHECK(tested > 200);
}

TEST_CASE("every form of the minimal rotation is the same") {
    const std::vector<float> in = inputs(1000, 15);
    for (std::size_t item = 0; item < 1000; ++item) {
        const auto v = [&](std::size_t i) {
            const float* p = &in[item * kInputs + 3 * i];
            return Vec3<double>(double(p[0]), double(p[1]), double(p[2]));
        };
        const auto a = normalize_or(v(0), {0, 0, 1}), b = normalize_or(v(1), {0, 0, 1});
        if (dot(a, b) < -0.999) continue;
        const auto target = bend_target(a, b, v(2), dot(a, v(2)), bend_inverse(a, b));
        const auto turned = minimal_rotation(a, b, any_perpendicular(a), v(2));
        REQUIRE(length(target - turned) < 1e-9);
        REQUIRE(length(minimal_turn(a, b, v(2)) - turned) < 1e-9);
    }
}
