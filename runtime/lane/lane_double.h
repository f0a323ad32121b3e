// Packs of doubles, one value a lane, and the masks that comparing them gives. Double1 is always
// there; Double4 and Double8 exist where the file is compiled for AVX2 or AVX-512. A kernel is a
// template on the pack and is compiled once for each instruction set (runtime/lane/instruction_set.h).
//
// mul_add(a, b, c) = a b + c and sub_mul(c, a, b) = c - a b are fused in Double4 and Double8 and round
// twice in Double1: the two wide packs agree in every bit, Double1 agrees with them to rounding.
#pragma once

#include <cmath>
#include <cstdint>

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

#define KERATIN_LANE_INLINE [[gnu::always_inline]] inline

namespace keratin {

struct Mask1 {
    bool m;
    KERATIN_LANE_INLINE friend Mask1 operator&(Mask1 a, Mask1 b) { return {a.m && b.m}; }
    KERATIN_LANE_INLINE friend Mask1 operator|(Mask1 a, Mask1 b) { return {a.m || b.m}; }
    KERATIN_LANE_INLINE friend Mask1 operator!(Mask1 a) { return {!a.m}; }
};

struct Double1 {
    static constexpr int width = 1;
    using Mask = Mask1;
    double v;
    Double1() = default;
    KERATIN_LANE_INLINE Double1(double a) : v(a) {}
    KERATIN_LANE_INLINE static Double1 load(const double* p) { return *p; }
    KERATIN_LANE_INLINE static Double1 load(const float* p) { return static_cast<double>(*p); }
    KERATIN_LANE_INLINE void store(double* p) const { *p = v; }
    KERATIN_LANE_INLINE friend Double1 operator+(Double1 a, Double1 b) { return a.v + b.v; }
    KERATIN_LANE_INLINE friend Double1 operator-(Double1 a, Double1 b) { return a.v - b.v; }
    KERATIN_LANE_INLINE friend Double1 operator*(Double1 a, Double1 b) { return a.v * b.v; }
    KERATIN_LANE_INLINE friend Double1 operator/(Double1 a, Double1 b) { return a.v / b.v; }
    KERATIN_LANE_INLINE friend Double1 operator-(Double1 a) { return -a.v; }
    KERATIN_LANE_INLINE friend Mask operator<(Double1 a, Double1 b) { return {a.v < b.v}; }
    KERATIN_LANE_INLINE friend Mask operator>(Double1 a, Double1 b) { return {a.v > b.v}; }
};
KERATIN_LANE_INLINE Double1 mul_add(Double1 a, Double1 b, Double1 c) { return a.v * b.v + c.v; }
KERATIN_LANE_INLINE Double1 sub_mul(Double1 c, Double1 a, Double1 b) { return c.v - a.v * b.v; }
KERATIN_LANE_INLINE Double1 sqrt(Double1 a) { return std::sqrt(a.v); }
KERATIN_LANE_INLINE Double1 abs(Double1 a) { return std::fabs(a.v); }
KERATIN_LANE_INLINE Double1 min(Double1 a, Double1 b) { return a.v < b.v ? a.v : b.v; }
KERATIN_LANE_INLINE Double1 max(Double1 a, Double1 b) { return a.v > b.v ? a.v : b.v; }
KERATIN_LANE_INLINE Double1 round(Double1 a) { return std::nearbyint(a.v); }
KERATIN_LANE_INLINE Double1 copy_sign(Double1 a, Double1 sign) { return std::copysign(a.v, sign.v); }
KERATIN_LANE_INLINE Double1 select(Mask1 m, Double1 a, Double1 b) { return m.m ? a : b; }
KERATIN_LANE_INLINE unsigned bits(Mask1 m) { return m.m; }
// Lanes of a mask from the low bits of a number, lane 0 in bit 0.
KERATIN_LANE_INLINE Mask1 mask_from_bits(Double1, unsigned b) { return {(b & 1u) != 0}; }

#if defined(__AVX2__) && defined(__FMA__)
struct Mask4 {
    __m256d m;
    KERATIN_LANE_INLINE friend Mask4 operator&(Mask4 a, Mask4 b) { return {_mm256_and_pd(a.m, b.m)}; }
    KERATIN_LANE_INLINE friend Mask4 operator|(Mask4 a, Mask4 b) { return {_mm256_or_pd(a.m, b.m)}; }
    KERATIN_LANE_INLINE friend Mask4 operator!(Mask4 a) {
        return {_mm256_xor_pd(a.m, _mm256_castsi256_pd(_mm256_set1_epi64x(-1)))};
    }
};

struct Double4 {
    static constexpr int width = 4;
    using Mask = Mask4;
    __m256d v;
    Double4() = default;
    KERATIN_LANE_INLINE Double4(__m256d a) : v(a) {}
    KERATIN_LANE_INLINE Double4(double a) : v(_mm256_set1_pd(a)) {}
    KERATIN_LANE_INLINE static Double4 load(const double* p) { return _mm256_load_pd(p); }
    KERATIN_LANE_INLINE static Double4 load(const float* p) { return _mm256_cvtps_pd(_mm_load_ps(p)); }
    KERATIN_LANE_INLINE void store(double* p) const { _mm256_store_pd(p, v); }
    KERATIN_LANE_INLINE friend Double4 operator+(Double4 a, Double4 b) { return _mm256_add_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double4 operator-(Double4 a, Double4 b) { return _mm256_sub_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double4 operator*(Double4 a, Double4 b) { return _mm256_mul_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double4 operator/(Double4 a, Double4 b) { return _mm256_div_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double4 operator-(Double4 a) {
        return _mm256_xor_pd(a.v, _mm256_set1_pd(-0.0));
    }
    KERATIN_LANE_INLINE friend Mask operator<(Double4 a, Double4 b) {
        return {_mm256_cmp_pd(a.v, b.v, _CMP_LT_OQ)};
    }
    KERATIN_LANE_INLINE friend Mask operator>(Double4 a, Double4 b) {
        return {_mm256_cmp_pd(a.v, b.v, _CMP_GT_OQ)};
    }
};
KERATIN_LANE_INLINE Double4 mul_add(Double4 a, Double4 b, Double4 c) {
    return _mm256_fmadd_pd(a.v, b.v, c.v);
}
KERATIN_LANE_INLINE Double4 sub_mul(Double4 c, Double4 a, Double4 b) {
    return _mm256_fnmadd_pd(a.v, b.v, c.v);
}
KERATIN_LANE_INLINE Double4 sqrt(Double4 a) { return _mm256_sqrt_pd(a.v); }
KERATIN_LANE_INLINE Double4 abs(Double4 a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a.v); }
KERATIN_LANE_INLINE Double4 min(Double4 a, Double4 b) { return _mm256_min_pd(a.v, b.v); }
KERATIN_LANE_INLINE Double4 max(Double4 a, Double4 b) { return _mm256_max_pd(a.v, b.v); }
KERATIN_LANE_INLINE Double4 round(Double4 a) {
    return _mm256_round_pd(a.v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}
KERATIN_LANE_INLINE Double4 copy_sign(Double4 a, Double4 sign) {
    const __m256d s = _mm256_set1_pd(-0.0);
    return _mm256_or_pd(_mm256_andnot_pd(s, a.v), _mm256_and_pd(s, sign.v));
}
KERATIN_LANE_INLINE Double4 select(Mask4 m, Double4 a, Double4 b) {
    return _mm256_blendv_pd(b.v, a.v, m.m);
}
KERATIN_LANE_INLINE unsigned bits(Mask4 m) { return static_cast<unsigned>(_mm256_movemask_pd(m.m)); }
KERATIN_LANE_INLINE Mask4 mask_from_bits(Double4, unsigned b) {
    const __m256i lanes = _mm256_set_epi64x(8, 4, 2, 1);
    const __m256i set = _mm256_and_si256(_mm256_set1_epi64x(static_cast<long long>(b)), lanes);
    return {_mm256_castsi256_pd(_mm256_cmpeq_epi64(set, lanes))};
}
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
struct Mask8 {
    __mmask8 m;
    KERATIN_LANE_INLINE friend Mask8 operator&(Mask8 a, Mask8 b) { return {_kand_mask8(a.m, b.m)}; }
    KERATIN_LANE_INLINE friend Mask8 operator|(Mask8 a, Mask8 b) { return {_kor_mask8(a.m, b.m)}; }
    KERATIN_LANE_INLINE friend Mask8 operator!(Mask8 a) { return {_knot_mask8(a.m)}; }
};

struct Double8 {
    static constexpr int width = 8;
    using Mask = Mask8;
    __m512d v;
    Double8() = default;
    KERATIN_LANE_INLINE Double8(__m512d a) : v(a) {}
    KERATIN_LANE_INLINE Double8(double a) : v(_mm512_set1_pd(a)) {}
    KERATIN_LANE_INLINE static Double8 load(const double* p) { return _mm512_load_pd(p); }
    KERATIN_LANE_INLINE static Double8 load(const float* p) { return _mm512_cvtps_pd(_mm256_load_ps(p)); }
    KERATIN_LANE_INLINE void store(double* p) const { _mm512_store_pd(p, v); }
    KERATIN_LANE_INLINE friend Double8 operator+(Double8 a, Double8 b) { return _mm512_add_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double8 operator-(Double8 a, Double8 b) { return _mm512_sub_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double8 operator*(Double8 a, Double8 b) { return _mm512_mul_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double8 operator/(Double8 a, Double8 b) { return _mm512_div_pd(a.v, b.v); }
    KERATIN_LANE_INLINE friend Double8 operator-(Double8 a) {
        return _mm512_xor_pd(a.v, _mm512_set1_pd(-0.0));
    }
    KERATIN_LANE_INLINE friend Mask operator<(Double8 a, Double8 b) {
        return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_LT_OQ)};
    }
    KERATIN_LANE_INLINE friend Mask operator>(Double8 a, Double8 b) {
        return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_GT_OQ)};
    }
};
KERATIN_LANE_INLINE Double8 mul_add(Double8 a, Double8 b, Double8 c) {
    return _mm512_fmadd_pd(a.v, b.v, c.v);
}
KERATIN_LANE_INLINE Double8 sub_mul(Double8 c, Double8 a, Double8 b) {
    return _mm512_fnmadd_pd(a.v, b.v, c.v);
}
KERATIN_LANE_INLINE Double8 sqrt(Double8 a) { return _mm512_sqrt_pd(a.v); }
KERATIN_LANE_INLINE Double8 abs(Double8 a) { return _mm512_andnot_pd(_mm512_set1_pd(-0.0), a.v); }
KERATIN_LANE_INLINE Double8 min(Double8 a, Double8 b) { return _mm512_min_pd(a.v, b.v); }
KERATIN_LANE_INLINE Double8 max(Double8 a, Double8 b) { return _mm512_max_pd(a.v, b.v); }
KERATIN_LANE_INLINE Double8 round(Double8 a) {
    return _mm512_roundscale_pd(a.v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}
KERATIN_LANE_INLINE Double8 copy_sign(Double8 a, Double8 sign) {
    const __m512d s = _mm512_set1_pd(-0.0);
    return _mm512_or_pd(_mm512_andnot_pd(s, a.v), _mm512_and_pd(s, sign.v));
}
KERATIN_LANE_INLINE Double8 select(Mask8 m, Double8 a, Double8 b) {
    return _mm512_mask_blend_pd(m.m, b.v, a.v);
}
KERATIN_LANE_INLINE unsigned bits(Mask8 m) { return _cvtmask8_u32(m.m); }
KERATIN_LANE_INLINE Mask8 mask_from_bits(Double8, unsigned b) { return {_cvtu32_mask8(b)}; }
#endif

}  // namespace keratin
