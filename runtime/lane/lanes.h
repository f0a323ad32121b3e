// Packs of 16, 32 and 64 float lanes, nested pairs around the native vector (an array member would
// be kept in memory by the compiler). A pack of 16 is one tile; wider packs take the same row of
// neighbouring tiles, which hides the latency of sweeps along the strands.
#pragma once

#include "runtime/lane/native.h"

#include <cstddef>

namespace keratin::KERATIN_ISA {

template <class T>
struct PairMask {
    T a, b;
};
template <class T>
KERATIN_ALWAYS_INLINE PairMask<T> operator&(PairMask<T> x, PairMask<T> y) {
    return {x.a & y.a, x.b & y.b};
}
template <class T>
KERATIN_ALWAYS_INLINE PairMask<T> operator|(PairMask<T> x, PairMask<T> y) {
    return {x.a | y.a, x.b | y.b};
}

template <class T>
struct Pair {
    static constexpr int kLanes = 2 * T::kLanes;
    T a, b;

    Pair() = default;
    KERATIN_ALWAYS_INLINE Pair(T x, T y) : a(x), b(y) {}
    KERATIN_ALWAYS_INLINE explicit Pair(float x) : a(x), b(x) {}

    friend KERATIN_ALWAYS_INLINE Pair operator+(const Pair& x, const Pair& y) {
        return Pair(x.a + y.a, x.b + y.b);
    }
    friend KERATIN_ALWAYS_INLINE Pair operator-(const Pair& x, const Pair& y) {
        return Pair(x.a - y.a, x.b - y.b);
    }
    friend KERATIN_ALWAYS_INLINE Pair operator*(const Pair& x, const Pair& y) {
        return Pair(x.a * y.a, x.b * y.b);
    }
    friend KERATIN_ALWAYS_INLINE Pair operator/(const Pair& x, const Pair& y) {
        return Pair(x.a / y.a, x.b / y.b);
    }
    friend KERATIN_ALWAYS_INLINE Pair operator-(const Pair& x) { return Pair(-x.a, -x.b); }
    friend KERATIN_ALWAYS_INLINE auto operator<(const Pair& x, const Pair& y) {
        return PairMask<decltype(x.a < y.a)>{x.a < y.a, x.b < y.b};
    }
    friend KERATIN_ALWAYS_INLINE auto operator<=(const Pair& x, const Pair& y) {
        return PairMask<decltype(x.a <= y.a)>{x.a <= y.a, x.b <= y.b};
    }
};
template <class M, class T>
KERATIN_ALWAYS_INLINE Pair<T> select(const PairMask<M>& c, const Pair<T>& x, const Pair<T>& y) {
    return Pair<T>(select(c.a, x.a, y.a), select(c.b, x.b, y.b));
}
template <class T>
KERATIN_ALWAYS_INLINE Pair<T> min(const Pair<T>& x, const Pair<T>& y) {
    return Pair<T>(min(x.a, y.a), min(x.b, y.b));
}
template <class T>
KERATIN_ALWAYS_INLINE Pair<T> max(const Pair<T>& x, const Pair<T>& y) {
    return Pair<T>(max(x.a, y.a), max(x.b, y.b));
}
template <class T>
KERATIN_ALWAYS_INLINE Pair<T> sqrt(const Pair<T>& x) {
    return Pair<T>(sqrt(x.a), sqrt(x.b));
}
template <class T>
KERATIN_ALWAYS_INLINE Pair<T> abs(const Pair<T>& x) {
    return Pair<T>(abs(x.a), abs(x.b));
}

KERATIN_ALWAYS_INLINE Native round_even(Native x) {
    return (x + Native(12582912.0f)) - Native(12582912.0f);
}
template <class T>
KERATIN_ALWAYS_INLINE Pair<T> round_even(const Pair<T>& x) {
    return Pair<T>(round_even(x.a), round_even(x.b));
}

KERATIN_ALWAYS_INLINE bool any(NativeMask m) { return bits(m) != 0; }
template <class T>
KERATIN_ALWAYS_INLINE bool any(const PairMask<T>& m) {
    return any(m.a) || any(m.b);
}

// One bit a lane, lane 0 lowest.
KERATIN_ALWAYS_INLINE unsigned long long lane_bits(NativeMask m) { return bits(m); }
template <class T>
KERATIN_ALWAYS_INLINE unsigned long long lane_bits(const PairMask<T>& m);

namespace detail {
template <class M>
struct MaskLanes;
template <>
struct MaskLanes<NativeMask> {
    static constexpr int value = Native::kLanes;
};
template <class T>
struct MaskLanes<PairMask<T>> {
    static constexpr int value = 2 * MaskLanes<T>::value;
};

template <int kLanes>
struct PackOf {
    using type = Pair<typename PackOf<kLanes / 2>::type>;
};
template <>
struct PackOf<Native::kLanes> {
    using type = Native;
};
}  // namespace detail

template <class T>
KERATIN_ALWAYS_INLINE unsigned long long lane_bits(const PairMask<T>& m) {
    return lane_bits(m.a) | lane_bits(m.b) << detail::MaskLanes<T>::value;
}

template <int kLanes>
using Lanes = typename detail::PackOf<kLanes>::type;

// What the strand passes work on at a time: as many lanes as keep four native vectors in flight.
#if defined(__AVX512F__)
inline constexpr int kWorkLanes = 32;
#elif defined(__AVX2__)
inline constexpr int kWorkLanes = 32;
#else
inline constexpr int kWorkLanes = 16;
#endif
using Work = Lanes<kWorkLanes>;

// Loads and stores a pack whose tiles of 16 lanes lie tile_stride floats apart.
template <class Pack>
KERATIN_ALWAYS_INLINE Pack load(const float* p, std::size_t tile_stride) {
    if constexpr (Pack::kLanes == Native::kLanes) {
        return Pack::load(p);
    } else if constexpr (Pack::kLanes <= 16) {
        using Half = Lanes<Pack::kLanes / 2>;
        return Pack(load<Half>(p, 0), load<Half>(p + Half::kLanes, 0));
    } else {
        using Half = Lanes<Pack::kLanes / 2>;
        return Pack(load<Half>(p, tile_stride),
                    load<Half>(p + tile_stride * (Half::kLanes / 16), tile_stride));
    }
}
template <class Pack>
KERATIN_ALWAYS_INLINE void store(const Pack& x, float* p, std::size_t tile_stride) {
    if constexpr (Pack::kLanes == Native::kLanes) {
        x.store(p);
    } else if constexpr (Pack::kLanes <= 16) {
        store(x.a, p, 0);
        store(x.b, p + Pack::kLanes / 2, 0);
    } else {
        store(x.a, p, tile_stride);
        store(x.b, p + tile_stride * (Pack::kLanes / 32), tile_stride);
    }
}
// Takes pairs apart that lie one after the other, as many as the pack has lanes.
template <class Pack>
KERATIN_ALWAYS_INLINE void load_pairs(const float* p, Pack& first, Pack& second) {
    if constexpr (Pack::kLanes == Native::kLanes) {
        take_apart(Native::load(p), Native::load(p + Native::kLanes), first, second);
    } else {
        load_pairs(p, first.a, second.a);
        load_pairs(p + Pack::kLanes, first.b, second.b);
    }
}
// A vector of three at a row of a tiled array: components 16 floats apart.
template <class Pack>
KERATIN_ALWAYS_INLINE Vec3<Pack> load3(const float* p, std::size_t tile_stride) {
    return Vec3<Pack>(load<Pack>(p, tile_stride), load<Pack>(p + 16, tile_stride),
                      load<Pack>(p + 32, tile_stride));
}
template <class Pack>
KERATIN_ALWAYS_INLINE void store3(const Vec3<Pack>& x, float* p, std::size_t tile_stride) {
    store(x.x, p, tile_stride);
    store(x.y, p + 16, tile_stride);
    store(x.z, p + 32, tile_stride);
}

// Smallest and largest lane.
KERATIN_ALWAYS_INLINE float lowest(Native x) {
    float v[Native::kLanes];
    x.store(v);
    float r = v[0];
    for (int i = 1; i < Native::kLanes; ++i) r = v[i] < r ? v[i] : r;
    return r;
}
KERATIN_ALWAYS_INLINE float highest(Native x) { return -lowest(-x); }
template <class T>
KERATIN_ALWAYS_INLINE float lowest(const Pair<T>& x) {
    return lowest(min(x.a, x.b));
}
template <class T>
KERATIN_ALWAYS_INLINE float highest(const Pair<T>& x) {
    return highest(max(x.a, x.b));
}

}  // namespace keratin::KERATIN_ISA
