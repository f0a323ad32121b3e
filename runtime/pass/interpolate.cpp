// Render strands from three guides (METHODS 1.5): the rest pose carried by the strand's own root,
// moved by the weighted displacement of the guides.
#include "runtime/formula/interpolate.h"

#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

#include <cstring>

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

// Displacement of a quad's guides from their carried rest pose, one line a strand.
void guide_lines(const Quad& quad, float* lines) {
    using Tile = Lanes<16>;
    for (std::size_t tile = 0; tile < kQuadTiles; ++tile) {
        const float* p = quad.root_end + tile * quad.root_stride;
        const auto at = [&](std::size_t c) { return load<Tile>(p + c * kTileLanes, 0); };
        const Vec4<Tile> q(at(0), at(1), at(2), at(3));
        const Vec3<Tile> t(at(4), at(5), at(6));
        float* out = lines + tile * quad.rows * 48;
        for (std::uint32_t row = 0; row < quad.rows; ++row) {
            const std::size_t place = (tile * quad.rows + row) * 48;
            const Vec3<Tile> d = load3<Tile>(quad.position + place, 0) -
                                 carried(q, t, load3<Tile>(quad.rest + place, 0));
            alignas(64) float v[3][16];
            store(d.x, v[0], 0);
            store(d.y, v[1], 0);
            store(d.z, v[2], 0);
            for (std::size_t l = 0; l < kTileLanes; ++l) {
                float* o = out + (l * quad.rows + row) * 3;
                o[0] = v[0][l], o[1] = v[1][l], o[2] = v[2][l];
            }
        }
    }
}

namespace {

// Points that are put together before they go out: a few strands, in the first-level cache.
constexpr std::size_t kStage = 1024;
constexpr std::size_t kLongest = kBakeMaxPoints;

// Round to nearest even, with denormals and infinities: the same as the instruction.
[[maybe_unused]] std::uint16_t to_half(float value) {
    std::uint32_t f;
    std::memcpy(&f, &value, 4);
    const std::uint32_t sign = f >> 16 & 0x8000u;
    f &= 0x7fffffffu;
    if (f > 0x7f800000u) return std::uint16_t(sign | 0x7e00u);
    if (f >= 0x477ff000u) return std::uint16_t(sign | 0x7c00u);
    if (f <
        0x38800000u) {  // below the smallest normal half: adding 0.5 leaves the rounded multiple
        float magnitude;
        std::memcpy(&magnitude, &f, 4);
        magnitude += 0.5f;
        std::uint32_t bits;
        std::memcpy(&bits, &magnitude, 4);
        return std::uint16_t(sign | (bits - 0x3f000000u));
    }
    const std::uint32_t rounded = f + 0xfffu + (f >> 13 & 1u);
    return std::uint16_t(sign | ((rounded - 0x38000000u) >> 13));
}

KERATIN_ALWAYS_INLINE void store_half(const Native& x, std::uint16_t* to) {
#if defined(__AVX512F__)
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                        _mm512_cvtps_ph(x.v, _MM_FROUND_TO_NEAREST_INT));
#elif defined(__F16C__)
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to),
                     _mm256_cvtps_ph(x.v, _MM_FROUND_TO_NEAREST_INT));
#else
    float v[Native::kLanes];
    x.store(v);
    for (int i = 0; i < Native::kLanes; ++i) to[i] = to_half(v[i]);
#endif
}
template <class T>
KERATIN_ALWAYS_INLINE void store_half(const Pair<T>& x, std::uint16_t* to) {
    store_half(x.a, to);
    store_half(x.b, to + T::kLanes);
}

// Whole cache lines past the cache, the ragged ends through it.
template <class T>
void stream_out(const T* from, std::size_t count, T* to) {
    constexpr std::size_t line = 64 / sizeof(T);
    std::size_t i = 0;
#if defined(__SSE2__)
    const std::size_t ahead = (64 - reinterpret_cast<std::uintptr_t>(to) % 64) % 64 / sizeof(T);
    for (; i < ahead && i < count; ++i) to[i] = from[i];
    for (; i + line <= count; i += line)
        for (std::size_t k = 0; k < line; k += line / 4)
            _mm_stream_si128(reinterpret_cast<__m128i*>(to + i + k),
                             _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + i + k)));
#endif
    for (; i < count; ++i) to[i] = from[i];
}

// Floats that are worked on at a time; three chunks are 16 points.
using Chunk = Lanes<16>;
constexpr std::size_t kChunk = 16;

// R x + t - center for points x, y, z, x, y, z, ... All instruction sets add up in the same order,
// from +0, so that zeros have the same sign.
class Carrier {
  public:
    // What `carry` reads before its points and behind them.
    static constexpr std::size_t kBefore = 2, kAfter = 3 * kChunk;

    Carrier(const float* root, const float* center) {
        const Vec4<float> q(root[0], root[1], root[2], root[3]);
        const Vec3<float> column[3] = {rotate(q, Vec3<float>(1, 0, 0)),
                                       rotate(q, Vec3<float>(0, 1, 0)),
                                       rotate(q, Vec3<float>(0, 0, 1))};
        const float matrix[3][3] = {{column[0].x, column[1].x, column[2].x},
                                    {column[0].y, column[1].y, column[2].y},
                                    {column[0].z, column[1].z, column[2].z}};
        const float offset[3] = {root[4] - center[0], root[5] - center[1], root[6] - center[2]};
        set(matrix, offset);
    }

#if defined(__AVX512F__)
    // An order of 48 numbers in three chunks as two picks out of two chunks each: from the first
    // and the second, then from what that gives and the third. An index of 16 or more is of the
    // second operand.
    struct Order {
        alignas(64) int first[3][16] = {}, second[3][16] = {};

        // source(i): where number i comes from.
        template <class Source>
        constexpr explicit Order(Source source) {
            for (int i = 0; i < 48; ++i) {
                const int from = source(i);
                if (from < 32) first[i / 16][i % 16] = from;
                second[i / 16][i % 16] = from < 32 ? i % 16 : from - 16;
            }
        }
    };
    static KERATIN_ALWAYS_INLINE void arrange(const Order& order, const Chunk (&in)[3],
                                              Chunk (&out)[3]) {
        const __m512 a = in[0].v, b = in[1].v, c = in[2].v;
        for (int k = 0; k < 3; ++k)
            out[k] = _mm512_permutex2var_ps(
                _mm512_permutex2var_ps(a, _mm512_load_si512(order.first[k]), b),
                _mm512_load_si512(order.second[k]), c);
    }

    // Chunk k of the 16 points at p.
    struct Carried {
        Chunk chunk[3];

        KERATIN_ALWAYS_INLINE Carried(const Carrier& f, const float* p) {
            Chunk in[3], out[3];
            // Three chunks of points to x, y and z of 16 points, and back.
            static constexpr Order kApart([](int i) { return i % 16 * 3 + i / 16; }),
                kTogether([](int i) { return i % 3 * 16 + i / 3; });
            for (std::size_t k = 0; k < 3; ++k) in[k] = load<Chunk>(p + k * kChunk, 0);
            arrange(kApart, in, in);
            for (int r = 0; r < 3; ++r)
                out[r] = Chunk(0.0f) + f.factor_[r][0] * in[0] + f.factor_[r][1] * in[1] +
                         f.factor_[r][2] * in[2] + f.offset_[r];
            arrange(kTogether, out, chunk);
        }
        KERATIN_ALWAYS_INLINE const Chunk& operator[](std::size_t k) const { return chunk[k]; }
    };

  private:
    Chunk factor_[3][3], offset_[3];

    void set(const float (&matrix)[3][3], const float (&offset)[3]) {
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) factor_[r][c] = Chunk(matrix[r][c]);
            offset_[r] = Chunk(offset[r]);
        }
    }

#else
    // Without taking the points apart: every number is a sum over those up to two places away, with
    // factors of period 3.
    struct Carried {
        const Carrier& f;
        const float* p;

        KERATIN_ALWAYS_INLINE Carried(const Carrier& carrier, const float* at)
            : f(carrier), p(at) {}
        KERATIN_ALWAYS_INLINE Chunk operator[](std::size_t k) const {
            Chunk x(0.0f);
            for (int o = 0; o < 5; ++o)
                x = x + f.factor_[k][o] * load<Chunk>(p + k * kChunk + o - 2, 0);
            return x + f.offset_[k];
        }
    };

  private:
    Chunk factor_[3][5], offset_[3];

    void set(const float (&matrix)[3][3], const float (&offset)[3]) {
        alignas(64) float factors[5][3 * kChunk] = {}, offsets[3 * kChunk];
        for (int i = 0; i < int(3 * kChunk); ++i) {
            const int row = i % 3;
            for (int c = 0; c < 3; ++c) factors[2 + c - row][i] = matrix[row][c];
            offsets[i] = offset[row];
        }
        for (std::size_t k = 0; k < 3; ++k) {
            for (int o = 0; o < 5; ++o) factor_[k][o] = load<Chunk>(factors[o] + k * kChunk, 0);
            offset_[k] = load<Chunk>(offsets + k * kChunk, 0);
        }
    }
#endif
};

KERATIN_ALWAYS_INLINE void put(const Chunk& x, float* to) { store(x, to, 0); }
KERATIN_ALWAYS_INLINE void put(const Chunk& x, std::uint16_t* to) { store_half(x, to); }

// The rest pose carried, and the weighted displacement of three guides added, point for point,
// where `moved`. Reads of `rest` what a Carrier does, and up to kLineBehind behind the lines' end.
template <bool moved, class T>
KERATIN_ALWAYS_INLINE void carry(const Carrier& f, const float* rest, const float* const line[3],
                                 const float* weight, std::size_t count, T* out) {
    const Chunk wa(moved ? weight[0] : 0), wb(moved ? weight[1] : 0), wc(moved ? weight[2] : 0);
    for (std::size_t i = 0; i < count; i += 3 * kChunk) {
        const Carrier::Carried carried(f, rest + i);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t at = i + k * kChunk;
            if (at >= count) return;
            Chunk x = carried[k];
            if constexpr (moved)
                x = x + (wa * load<Chunk>(line[0] + at, 0) + wb * load<Chunk>(line[1] + at, 0) +
                         wc * load<Chunk>(line[2] + at, 0));
            put(x, out + at);
        }
    }
}

// Adds the weighted displacement of one guide whose points do not stand at the strand's fractions.
void add_line(const StrandBatch& b, std::uint32_t lane, float weight, std::uint32_t first,
              std::uint32_t count, float* out) {
    const float* line = b.line + line_first(b.tile_first_row, lane);
    const std::uint32_t guide_points = b.guide_point_count[lane];
    const float* guide_fraction =
        b.fraction ? b.fraction + b.first_point[b.guide_strand[lane]] : nullptr;
    const float last = float(guide_points - 1);
    std::uint32_t k = 0;
    for (std::uint32_t j = 0; j < count; ++j) {
        float s;
        if (guide_fraction) {
            const float f = b.fraction[first + j];
            while (k + 2 < guide_points && guide_fraction[k + 1] < f) ++k;
            const float span = guide_fraction[k + 1] - guide_fraction[k];
            s = span > 0 ? (f - guide_fraction[k]) / span : 1.0f;
            s = keratin::min(keratin::max(s, 0.0f), 1.0f);
        } else {
            const float place = count > 1 ? float(j) * last / float(count - 1) : 0.0f;
            k = std::uint32_t(place) < guide_points - 2 ? std::uint32_t(place) : guide_points - 2;
            s = place - float(k);
        }
        for (int c = 0; c < 3; ++c) {
            const float a = line[k * 3 + c], e = line[k * 3 + 3 + c];
            out[j * 3 + c] += weight * (a + (e - a) * s);
        }
    }
}

void write_tangents(const float* x, std::uint32_t count, float* out) {
    for (std::uint32_t j = 0; j < count; ++j) {
        const std::uint32_t a = j > 0 ? j - 1 : 0, e = j + 1 < count ? j + 1 : j;
        const Vec3<float> d(x[e * 3] - x[a * 3], x[e * 3 + 1] - x[a * 3 + 1],
                            x[e * 3 + 2] - x[a * 3 + 2]);
        const Vec3<float> t = normalize_or(d, Vec3<float>(0, 1, 0));
        out[j * 3] = t.x, out[j * 3 + 1] = t.y, out[j * 3 + 2] = t.z;
    }
}

// Strands begin .. end - 1 to `to`, which is all strands' positions, as float or as half.
template <class T>
void interpolate_as(const StrandBatch& b, std::uint32_t begin, std::uint32_t end, T* to) {
    constexpr bool half = sizeof(T) == 2;
    constexpr std::size_t kBefore = Carrier::kBefore, kAfter = Carrier::kAfter;
    alignas(64) float copy[kBefore + kLongest * 3 + kAfter];
    alignas(64) T stage[(kStage + kLongest) * 3 + kChunk];
    alignas(64) float one[half ? kLongest * 3 + kChunk : 1];
    std::size_t staged = 0;  // numbers
    std::size_t out = std::size_t{b.first_point[begin]} * 3;
    // Half floats keep eleven bits: they count from the middle of the body.
    const float world[3] = {};
    const float* center = half ? b.half_center : world;
    Carrier carrier(b.root + begin * b.root_stride, center);

    for (std::uint32_t s = begin; s < end; ++s) {
        if (b.root_stride != 0 && s > begin) carrier = Carrier(b.root + s * b.root_stride, center);
        const std::uint32_t first = b.first_point[s], count = b.first_point[s + 1] - first;
        const std::size_t numbers = std::size_t{count} * 3;
        // What stands before and behind a strand meets factors of zero; the array's own ends have
        // nothing there.
        const float* rest = b.rest + std::size_t{first} * 3;
        if (std::size_t{first} * 3 < kBefore ||
            std::size_t{first} * 3 + numbers + kAfter > b.points * 3) {
            std::memset(copy, 0, sizeof copy);
            std::memcpy(copy + kBefore, rest, numbers * sizeof(float));
            rest = copy + kBefore;
        }
        const std::uint32_t* guide = b.guide + std::size_t{s} * 3;
        const float* w = b.weight + std::size_t{s} * 3;
        const bool alike = b.line && !b.fraction && b.guide_point_count[guide[0]] == count &&
                           b.guide_point_count[guide[1]] == count &&
                           b.guide_point_count[guide[2]] == count;
        const auto fill = [&](auto* x) {
            if (!alike) return carry<false>(carrier, rest, nullptr, nullptr, numbers, x);
            const float* line[3];
            for (int k = 0; k < 3; ++k) line[k] = b.line + line_first(b.tile_first_row, guide[k]);
            carry<true>(carrier, rest, line, w, numbers, x);
        };
        const auto fill_floats = [&](float* x) {
            fill(x);
            if (b.line && !alike)
                for (int k = 0; k < 3; ++k) add_line(b, guide[k], w[k], first, count, x);
            if (b.tangent) write_tangents(x, count, b.tangent + std::size_t{first} * 3);
        };
        T* place = stage + staged;
        if constexpr (!half) {
            fill_floats(place);
        } else if (b.tangent || (b.line && !alike)) {
            fill_floats(one);
            for (std::size_t i = 0; i < numbers; i += kChunk)
                put(load<Chunk>(one + i, 0), place + i);
        } else {
            fill(place);
        }
        staged += numbers;

        if (staged >= kStage * 3 || s + 1 == end) {
            if (b.stream)
                stream_out(stage, staged, to + out);
            else
                std::memcpy(to + out, stage, staged * sizeof(T));
            out += staged;
            staged = 0;
        }
    }
#if defined(__SSE2__)
    if (b.stream) _mm_sfence();
#endif
}

}  // namespace

void interpolate(const StrandBatch& b, std::uint32_t begin, std::uint32_t end) {
    if (b.half)
        interpolate_as(b, begin, end, b.half);
    else
        interpolate_as(b, begin, end, b.position);
}

}  // namespace keratin::KERATIN_ISA
