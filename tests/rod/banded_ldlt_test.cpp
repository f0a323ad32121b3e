#include "runtime/rod/banded_ldlt.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <random>
#include <vector>

using namespace keratin;

namespace {

struct Aligned {
    explicit Aligned(std::size_t n) : store(n + 8, 0.0) {
        data = store.data() + (8 - reinterpret_cast<std::uintptr_t>(store.data()) / 8 % 8) % 8;
    }
    std::vector<double> store;
    double* data;
};

const InstructionSet kSets[] = {InstructionSet::baseline, InstructionSet::avx2,
                                InstructionSet::avx512};

}  // namespace

TEST_CASE("the banded factors solve a positive definite system in every lane") {
    const std::size_t rows = 57;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> in(-1, 1);
    for (const InstructionSet set : kSets) {
        const RodPasses& passes = rod_passes(set);
        const std::size_t lanes = passes.lanes;
        Aligned band((rows + 2 * kRodPadRows) * kRodBandWidth * lanes);
        Aligned x((rows + 2 * kRodPadRows) * 3 * lanes);
        double* h = band.data + kRodPadRows * kRodBandWidth * lanes;
        double* b = x.data + kRodPadRows * 3 * lanes;
        std::vector<double> dense(rows * rows * lanes, 0.0), right(rows * 3 * lanes);
        for (std::size_t r = 0; r < rows; ++r)
            for (std::size_t k = 0; k <= kRodHalfBand && k <= r; ++k)
                for (std::size_t l = 0; l < lanes; ++l) {
                    const double v = k == 0 ? 12 + in(random) : in(random);
                    h[(r * kRodBandWidth + kRodHalfBand - k) * lanes + l] = v;
                    dense[(r * rows + r - k) * lanes + l] = dense[((r - k) * rows + r) * lanes + l] = v;
                }
        for (std::size_t k = 0; k < right.size(); ++k) b[k] = right[k] = in(random);
        CHECK(passes.factor(rows, h) == 0);
        passes.apply_inverse(0, rows, h, b);
        double worst = 0;
        for (std::size_t r = 0; r < rows; ++r)
            for (std::size_t l = 0; l < 3 * lanes; ++l) {
                double sum = -right[r * 3 * lanes + l];
                for (std::size_t c = 0; c < rows; ++c)
                    sum += dense[(r * rows + c) * lanes + l % lanes] * b[c * 3 * lanes + l];
                worst = std::max(worst, std::abs(sum));
            }
        CHECK(worst < 1e-13);
    }
}

TEST_CASE("the banded factors name the lanes that are not positive definite") {
    const std::size_t rows = 20;
    for (const InstructionSet set : kSets) {
        const RodPasses& passes = rod_passes(set);
        const std::size_t lanes = passes.lanes;
        Aligned band((rows + 2 * kRodPadRows) * kRodBandWidth * lanes);
        double* h = band.data + kRodPadRows * kRodBandWidth * lanes;
        for (std::size_t r = 0; r < rows; ++r)
            for (std::size_t l = 0; l < lanes; ++l) h[(r * kRodBandWidth + kRodHalfBand) * lanes + l] = 1;
        const std::size_t bad = lanes - 1;
        h[(11 * kRodBandWidth + kRodHalfBand) * lanes + bad] = -1;
        CHECK(passes.factor(rows, h) == 1u << bad);
    }
}
