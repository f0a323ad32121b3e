// L D L^T of a symmetric matrix with half-bandwidth 10 and the two triangular solves, one matrix a
// lane (METHODS §2.3). Row by row: a row's ten entries stay in registers while the ten rows above are
// read. Rows of zeros before and after make the first and last rows like any other.
#pragma once

#include "runtime/lane/lane_double.h"
#include "runtime/rod/rod_pass.h"

namespace keratin {

template <class Real>
KERATIN_LANE_INLINE std::uint32_t factor_band(std::size_t rows, double* band) {
    constexpr std::size_t lanes = Real::width;
    std::uint32_t failed = 0;
    for (std::size_t r = 0; r < rows; ++r) {
        double* row = band + r * kRodBandWidth * lanes;
        Real v[kRodHalfBand];  // L D of this row
        Real pivot = Real::load(row + kRodHalfBand * lanes);
#pragma GCC unroll 10
        for (std::size_t k = 0; k < kRodHalfBand; ++k) {
            const double* other = row - (kRodHalfBand - k) * kRodBandWidth * lanes;
            Real a = Real::load(row + k * lanes);
#pragma GCC unroll 10
            for (std::size_t m = 0; m < k; ++m)
                a = sub_mul(a, v[m], Real::load(other + (kRodHalfBand - k + m) * lanes));
            v[k] = a;
            const Real l = a * Real::load(other + kRodHalfBand * lanes);
            l.store(row + k * lanes);
            pivot = sub_mul(pivot, a, l);
        }
        const auto good = pivot > Real(0.0);
        failed |= bits(!good);
        (Real(1.0) / select(good, pivot, Real(1.0))).store(row + kRodHalfBand * lanes);
    }
    return failed;
}

// The forward solve, first row to last: L y = x, given as load(r) and stored in x.
template <class Real, class Load>
KERATIN_LANE_INLINE void solve_lower(std::size_t rows, const double* band, double* x, Load load) {
    constexpr std::size_t lanes = Real::width;
    Real last(0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        const double* row = band + r * kRodBandWidth * lanes;
        double* y = x + r * lanes;
        Real a = load(r), b(0.0);
#pragma GCC unroll 9
        for (std::size_t k = 0; k + 1 < kRodHalfBand; ++k) {
            Real& sum = k % 2 == 0 ? b : a;
            sum = sub_mul(sum, Real::load(row + k * lanes), Real::load(y - (kRodHalfBand - k) * lanes));
        }
        last = sub_mul(a + b, Real::load(row + (kRodHalfBand - 1) * lanes), last);
        last.store(y);
    }
}

// The rest, last row to first: D L^T x = y in place; done(r, x_r) sees each result.
template <class Real, class Done>
KERATIN_LANE_INLINE void solve_upper(std::size_t rows, const double* band, double* x, Done done) {
    constexpr std::size_t lanes = Real::width;
    Real last(0.0);
    for (std::size_t r = rows; r-- > 0;) {
        const double* row = band + r * kRodBandWidth * lanes;
        double* y = x + r * lanes;
        Real a = Real::load(y) * Real::load(row + kRodHalfBand * lanes), b(0.0);
#pragma GCC unroll 9
        for (std::size_t k = kRodHalfBand; k > 1; --k) {
            const Real l = Real::load(row + (k * kRodBandWidth + kRodHalfBand - k) * lanes);
            Real& sum = k % 2 == 0 ? b : a;
            sum = sub_mul(sum, l, Real::load(y + k * lanes));
        }
        const Real l = Real::load(row + (kRodBandWidth + kRodHalfBand - 1) * lanes);
        last = sub_mul(a + b, l, last);
        last.store(y);
        done(r, last);
    }
}

// The numbers of three vectors in one row.
template <class Real>
struct RowOfThree {
    Real of[3];
    KERATIN_LANE_INLINE explicit RowOfThree(const double* x)
        : of{Real::load(x), Real::load(x + Real::width), Real::load(x + 2 * Real::width)} {}
    KERATIN_LANE_INLINE void subtract(const Real& l, const RowOfThree& other) {
#pragma GCC unroll 3
        for (std::size_t c = 0; c < 3; ++c) of[c] = sub_mul(of[c], l, other.of[c]);
    }
    KERATIN_LANE_INLINE void store(double* x) const {
#pragma GCC unroll 3
        for (std::size_t c = 0; c < 3; ++c) of[c].store(x + c * Real::width);
    }
};

// Both for three vectors at once, x [rows][3] in place: the band, most of what is read, is read
// once. x is 0 before row `first`, and only its rows from there on are solved for.
template <class Real>
KERATIN_LANE_INLINE void solve_three(std::size_t first, std::size_t rows, const double* band,
                                     double* x) {
    constexpr std::size_t lanes = Real::width, wide = 3 * lanes;
    using Row = RowOfThree<Real>;
    for (std::size_t r = first; r < rows; ++r) {
        const double* row = band + r * kRodBandWidth * lanes;
        double* y = x + r * wide;
        Row sum(y);
#pragma GCC unroll 10
        for (std::size_t k = 0; k < kRodHalfBand; ++k)
            sum.subtract(Real::load(row + k * lanes), Row(y - (kRodHalfBand - k) * wide));
        sum.store(y);
    }
    for (std::size_t r = rows; r-- > first;) {
        const double* row = band + r * kRodBandWidth * lanes;
        double* y = x + r * wide;
        Row sum(y);
        for (Real& s : sum.of) s = s * Real::load(row + kRodHalfBand * lanes);
#pragma GCC unroll 10
        for (std::size_t k = kRodHalfBand; k > 0; --k)
            sum.subtract(Real::load(row + (k * kRodBandWidth + kRodHalfBand - k) * lanes),
                         Row(y + k * wide));
        sum.store(y);
    }
}

}  // namespace keratin
