// The float vector of one instruction set. Which one is decided by the compiler's flags; files that
// include this are compiled once per instruction set with KERATIN_ISA naming a namespace of its
// own, so that no code for one processor is ever linked into the path of another.
//
// Every operation is the exactly rounded one, in the same order on every instruction set: no
// contraction, no estimates. So results are equal bit for bit.
#pragma once

#include <cmath>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "schema/formula/vec3.h"

#ifndef KERATIN_ISA
#define KERATIN_ISA baseline
#endif

namespace keratin::KERATIN_ISA {

#if defined(__AVX512F__)

struct NativeMask {
    __mmask16 m;
};
struct Native {
    static constexpr int kLanes = 16;
    __m512 v;

    Native() = default;
    KERATIN_ALWAYS_INLINE Native(__m512 a) : v(a) {}
    KERATIN_ALWAYS_INLINE explicit Native(float a) : v(_mm512_set1_ps(a)) {}
    static KERATIN_ALWAYS_INLINE Native load(const float* p) { return _mm512_loadu_ps(p); }
    KERATIN_ALWAYS_INLINE void store(float* p) const { _mm512_storeu_ps(p, v); }
};
KERATIN_ALWAYS_INLINE Native operator+(Native a, Native b) { return _mm512_add_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator-(Native a, Native b) { return _mm512_sub_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator*(Native a, Native b) { return _mm512_mul_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator/(Native a, Native b) { return _mm512_div_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator-(Native a) {
    return _mm512_castsi512_ps(
        _mm512_xor_si512(_mm512_castps_si512(a.v), _mm512_set1_epi32(int(0x80000000u))));
}
KERATIN_ALWAYS_INLINE NativeMask operator<(Native a, Native b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
}
KERATIN_ALWAYS_INLINE NativeMask operator<=(Native a, Native b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)};
}
KERATIN_ALWAYS_INLINE NativeMask operator&(NativeMask a, NativeMask b) {
    return {__mmask16(a.m & b.m)};
}
KERATIN_ALWAYS_INLINE NativeMask operator|(NativeMask a, NativeMask b) {
    return {__mmask16(a.m | b.m)};
}
KERATIN_ALWAYS_INLINE Native select(NativeMask c, Native a, Native b) {
    return _mm512_mask_blend_ps(c.m, b.v, a.v);
}
KERATIN_ALWAYS_INLINE unsigned bits(NativeMask a) { return a.m; }
KERATIN_ALWAYS_INLINE Native min(Native a, Native b) { return _mm512_min_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native max(Native a, Native b) { return _mm512_max_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native sqrt(Native a) { return _mm512_sqrt_ps(a.v); }
KERATIN_ALWAYS_INLINE Native abs(Native a) { return _mm512_abs_ps(a.v); }
// Every other lane of a and then b: even ones and odd ones.
KERATIN_ALWAYS_INLINE void take_apart(Native a, Native b, Native& even, Native& odd) {
    const __m512i from =
        _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    even = _mm512_permutex2var_ps(a.v, from, b.v);
    odd = _mm512_permutex2var_ps(a.v, _mm512_or_si512(from, _mm512_set1_epi32(1)), b.v);
}

#elif defined(__AVX2__)

struct NativeMask {
    __m256 m;
};
struct Native {
    static constexpr int kLanes = 8;
    __m256 v;

    Native() = default;
    KERATIN_ALWAYS_INLINE Native(__m256 a) : v(a) {}
    KERATIN_ALWAYS_INLINE explicit Native(float a) : v(_mm256_set1_ps(a)) {}
    static KERATIN_ALWAYS_INLINE Native load(const float* p) { return _mm256_loadu_ps(p); }
    KERATIN_ALWAYS_INLINE void store(float* p) const { _mm256_storeu_ps(p, v); }
};
KERATIN_ALWAYS_INLINE Native operator+(Native a, Native b) { return _mm256_add_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator-(Native a, Native b) { return _mm256_sub_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator*(Native a, Native b) { return _mm256_mul_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator/(Native a, Native b) { return _mm256_div_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator-(Native a) {
    return _mm256_xor_ps(a.v, _mm256_set1_ps(-0.0f));
}
KERATIN_ALWAYS_INLINE NativeMask operator<(Native a, Native b) {
    return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)};
}
KERATIN_ALWAYS_INLINE NativeMask operator<=(Native a, Native b) {
    return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)};
}
KERATIN_ALWAYS_INLINE NativeMask operator&(NativeMask a, NativeMask b) {
    return {_mm256_and_ps(a.m, b.m)};
}
KERATIN_ALWAYS_INLINE NativeMask operator|(NativeMask a, NativeMask b) {
    return {_mm256_or_ps(a.m, b.m)};
}
KERATIN_ALWAYS_INLINE Native select(NativeMask c, Native a, Native b) {
    return _mm256_blendv_ps(b.v, a.v, c.m);
}
KERATIN_ALWAYS_INLINE unsigned bits(NativeMask a) { return unsigned(_mm256_movemask_ps(a.m)); }
KERATIN_ALWAYS_INLINE Native min(Native a, Native b) { return _mm256_min_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native max(Native a, Native b) { return _mm256_max_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native sqrt(Native a) { return _mm256_sqrt_ps(a.v); }
KERATIN_ALWAYS_INLINE Native abs(Native a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v); }
KERATIN_ALWAYS_INLINE void take_apart(Native a, Native b, Native& even, Native& odd) {
    const auto in_order = [](__m256 v) {
        return _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(v), 0xd8));
    };
    even = in_order(_mm256_shuffle_ps(a.v, b.v, 0x88));
    odd = in_order(_mm256_shuffle_ps(a.v, b.v, 0xdd));
}

#elif defined(__SSE2__)

struct NativeMask {
    __m128 m;
};
struct Native {
    static constexpr int kLanes = 4;
    __m128 v;

    Native() = default;
    KERATIN_ALWAYS_INLINE Native(__m128 a) : v(a) {}
    KERATIN_ALWAYS_INLINE explicit Native(float a) : v(_mm_set1_ps(a)) {}
    static KERATIN_ALWAYS_INLINE Native load(const float* p) { return _mm_loadu_ps(p); }
    KERATIN_ALWAYS_INLINE void store(float* p) const { _mm_storeu_ps(p, v); }
};
KERATIN_ALWAYS_INLINE Native operator+(Native a, Native b) { return _mm_add_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator-(Native a, Native b) { return _mm_sub_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator*(Native a, Native b) { return _mm_mul_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator/(Native a, Native b) { return _mm_div_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native operator-(Native a) { return _mm_xor_ps(a.v, _mm_set1_ps(-0.0f)); }
KERATIN_ALWAYS_INLINE NativeMask operator<(Native a, Native b) { return {_mm_cmplt_ps(a.v, b.v)}; }
KERATIN_ALWAYS_INLINE NativeMask operator<=(Native a, Native b) { return {_mm_cmple_ps(a.v, b.v)}; }
KERATIN_ALWAYS_INLINE NativeMask operator&(NativeMask a, NativeMask b) {
    return {_mm_and_ps(a.m, b.m)};
}
KERATIN_ALWAYS_INLINE NativeMask operator|(NativeMask a, NativeMask b) {
    return {_mm_or_ps(a.m, b.m)};
}
KERATIN_ALWAYS_INLINE Native select(NativeMask c, Native a, Native b) {
    return _mm_or_ps(_mm_and_ps(c.m, a.v), _mm_andnot_ps(c.m, b.v));
}
KERATIN_ALWAYS_INLINE unsigned bits(NativeMask a) { return unsigned(_mm_movemask_ps(a.m)); }
KERATIN_ALWAYS_INLINE Native min(Native a, Native b) { return _mm_min_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native max(Native a, Native b) { return _mm_max_ps(a.v, b.v); }
KERATIN_ALWAYS_INLINE Native sqrt(Native a) { return _mm_sqrt_ps(a.v); }
KERATIN_ALWAYS_INLINE Native abs(Native a) { return _mm_andnot_ps(_mm_set1_ps(-0.0f), a.v); }
KERATIN_ALWAYS_INLINE void take_apart(Native a, Native b, Native& even, Native& odd) {
    even = _mm_shuffle_ps(a.v, b.v, 0x88);
    odd = _mm_shuffle_ps(a.v, b.v, 0xdd);
}

#else  // any other processor: four floats that the compiler may vectorise

struct NativeMask {
    bool m[4];
};
struct Native {
    static constexpr int kLanes = 4;
    float v[4];

    Native() = default;
    explicit Native(float a) : v{a, a, a, a} {}
    static Native load(const float* p) {
        Native r;
        for (int i = 0; i < 4; ++i) r.v[i] = p[i];
        return r;
    }
    void store(float* p) const {
        for (int i = 0; i < 4; ++i) p[i] = v[i];
    }
};
template <class F>
KERATIN_ALWAYS_INLINE Native each(F&& f) {
    Native r;
    for (int i = 0; i < 4; ++i) r.v[i] = f(i);
    return r;
}
KERATIN_ALWAYS_INLINE Native operator+(Native a, Native b) {
    return each([&](int i) { return a.v[i] + b.v[i]; });
}
KERATIN_ALWAYS_INLINE Native operator-(Native a, Native b) {
    return each([&](int i) { return a.v[i] - b.v[i]; });
}
KERATIN_ALWAYS_INLINE Native operator*(Native a, Native b) {
    return each([&](int i) { return a.v[i] * b.v[i]; });
}
KERATIN_ALWAYS_INLINE Native operator/(Native a, Native b) {
    return each([&](int i) { return a.v[i] / b.v[i]; });
}
KERATIN_ALWAYS_INLINE Native operator-(Native a) {
    return each([&](int i) { return -a.v[i]; });
}
KERATIN_ALWAYS_INLINE NativeMask operator<(Native a, Native b) {
    return {{a.v[0] < b.v[0], a.v[1] < b.v[1], a.v[2] < b.v[2], a.v[3] < b.v[3]}};
}
KERATIN_ALWAYS_INLINE NativeMask operator<=(Native a, Native b) {
    return {{a.v[0] <= b.v[0], a.v[1] <= b.v[1], a.v[2] <= b.v[2], a.v[3] <= b.v[3]}};
}
KERATIN_ALWAYS_INLINE NativeMask operator&(NativeMask a, NativeMask b) {
    return {{a.m[0] && b.m[0], a.m[1] && b.m[1], a.m[2] && b.m[2], a.m[3] && b.m[3]}};
}
KERATIN_ALWAYS_INLINE NativeMask operator|(NativeMask a, NativeMask b) {
    return {{a.m[0] || b.m[0], a.m[1] || b.m[1], a.m[2] || b.m[2], a.m[3] || b.m[3]}};
}
KERATIN_ALWAYS_INLINE Native select(NativeMask c, Native a, Native b) {
    return each([&](int i) { return c.m[i] ? a.v[i] : b.v[i]; });
}
KERATIN_ALWAYS_INLINE unsigned bits(NativeMask a) {
    return unsigned(a.m[0]) | unsigned(a.m[1]) << 1 | unsigned(a.m[2]) << 2 | unsigned(a.m[3]) << 3;
}
KERATIN_ALWAYS_INLINE Native min(Native a, Native b) {
    return each([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
}
KERATIN_ALWAYS_INLINE Native max(Native a, Native b) {
    return each([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
}
KERATIN_ALWAYS_INLINE Native sqrt(Native a) {
    return each([&](int i) { return std::sqrt(a.v[i]); });
}
KERATIN_ALWAYS_INLINE Native abs(Native a) {
    return each([&](int i) { return std::fabs(a.v[i]); });
}
KERATIN_ALWAYS_INLINE void take_apart(Native a, Native b, Native& even, Native& odd) {
    even = each([&](int i) { return i < 2 ? a.v[2 * i] : b.v[2 * i - 4]; });
    odd = each([&](int i) { return i < 2 ? a.v[2 * i + 1] : b.v[2 * i - 3]; });
}

#endif

}  // namespace keratin::KERATIN_ISA
