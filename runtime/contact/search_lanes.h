// The kernels of the search, for the instruction set that KERATIN_ISA names.
#pragma once

#include "runtime/contact/search_kernels.h"
#include "runtime/lane/lanes.h"

#include <cstddef>

namespace keratin::KERATIN_ISA {
namespace {

using Boxes = Lanes<16>;
using Boxes3 = Vec3<Boxes>;

KERATIN_ALWAYS_INLINE Box box_of(const BoxBlock& b, std::uint32_t i) {
    return {
        {b.bound[0][i], b.bound[1][i], b.bound[2][i], b.bound[3][i], b.bound[4][i], b.bound[5][i]}};
}

// Bit i: box i of the 16 that stand from the bounds' place `at` on overlaps q.
template <class Bounds>
KERATIN_ALWAYS_INLINE std::uint32_t overlapping(const Bounds& bound, std::uint32_t at,
                                                const Box& q) {
    const auto reaches = [&](int axis) {
        return (load<Boxes>(bound[axis] + at, 0) <= Boxes(q.bound[3 + axis])) &
               (Boxes(q.bound[axis]) <= load<Boxes>(bound[3 + axis] + at, 0));
    };
    return static_cast<std::uint32_t>(lane_bits(reaches(0) & reaches(1) & reaches(2)));
}

KERATIN_ALWAYS_INLINE void put(std::uint32_t i, std::uint32_t j, PairSink& out) {
    if (out.at == out.end) out.grow(out);
    *out.at++ = i < j ? BoxPair{i, j} : BoxPair{j, i};
}

KERATIN_ALWAYS_INLINE std::uint32_t take_lowest(std::uint32_t& mask) {
    const auto lowest = static_cast<std::uint32_t>(__builtin_ctz(mask));
    mask &= mask - 1;
    return lowest;
}

// Cells are searched forward only: each box looks for boxes that stand behind it, one run of
// consecutive boxes for each row of cells along x.
void search_grid(const GridView& g, std::uint32_t begin, std::uint32_t end, PairSink& out) {
    for (std::uint32_t k = begin; k < end; ++k) {
        Box q;
        for (int i = 0; i < 6; ++i) q.bound[i] = g.bound[i][k];
        const auto least = [&](int axis) { return g.cell(q.bound[axis] - g.largest[axis], axis); };
        const auto most = [&](int axis) { return g.cell(q.bound[3 + axis], axis); };
        const int cy = g.cell(q.bound[1], 1), cz = g.cell(q.bound[2], 2);
        const int x0 = least(0), x1 = most(0), y0 = least(1), y1 = most(1), z1 = most(2);
        for (int z = cz; z <= z1; ++z)
            for (int y = z == cz ? cy : y0; y <= y1; ++y) {
                const std::uint32_t row =
                    (static_cast<std::uint32_t>(z) * g.cells[1] + y) * g.cells[0];
                std::uint32_t i = g.start[row + x0];
                const std::uint32_t stop = g.start[row + x1 + 1];
                if (i <= k) i = k + 1;
                for (; i < stop; i += 16) {
                    std::uint32_t mask = overlapping(g.bound, i, q);
                    if (stop - i < 16) mask &= (1u << (stop - i)) - 1;
                    while (mask != 0) put(g.index[k], g.index[i + take_lowest(mask)], out);
                }
            }
    }
}

// Pairs within a block and of it with the blocks behind it. Of two blocks, only boxes that reach
// into the other are compared.
void search_tree(const TreeView& t, std::uint32_t begin, std::uint32_t end, PairSink& out) {
    struct Block {
        std::uint32_t level, number;
    };
    Block stack[16 * kMostLevels];
    const auto bounds_of = [&](std::uint32_t block) {
        return box_of(t.level[1][block / 16], block % 16);
    };
    const auto compare = [&](std::uint32_t own, std::uint32_t other) {
        const BoxBlock &a = t.level[0][own], &b = t.level[0][other];
        std::uint32_t rows = own == other ? 0xFFFFu : overlapping(a.bound, 0, bounds_of(other));
        while (rows != 0) {
            const std::uint32_t k = take_lowest(rows);
            std::uint32_t mask = overlapping(b.bound, 0, box_of(a, k));
            if (own == other) mask &= ~1u << k;
            while (mask != 0)
                put(t.index[16 * own + k], t.index[16 * other + take_lowest(mask)], out);
        }
    };
    for (std::uint32_t own = begin / 16; own < (end + 15) / 16; ++own) {
        compare(own, own);
        if (t.level_count == 1) continue;
        const Box around = bounds_of(own);
        int depth = 0;
        stack[depth++] = {t.level_count - 1, 0};
        while (depth > 0) {
            const auto [level, number] = stack[--depth];
            if (level == 0) {
                compare(own, number);
                continue;
            }
            std::uint32_t mask = overlapping(t.level[level][number].bound, 0, around);
            // The blocks behind this one, and at most one above it at each level.
            const std::uint32_t first = 16 * number;
            const std::uint32_t least = (own >> (4 * (level - 1))) + (level == 1);
            if (least > first) mask &= least - first >= 16 ? 0u : ~0u << (least - first);
            while (mask != 0) {
                const BoxBlock* below = t.level[level - 1] + first + __builtin_ctz(mask);
                for (const auto& bound : below->bound) __builtin_prefetch(bound);
                stack[depth++] = {level - 1, first + take_lowest(mask)};
            }
        }
    }
}

// A way from one place to another and the square of its length.
struct Way {
    Boxes3 way;
    Boxes square;
};

// From the nearest place of the segment from 0 along e to p; inverse: 1 / e.e.
KERATIN_ALWAYS_INLINE Way way_to(const Boxes3& p, const Boxes3& e, Boxes inverse) {
    const Boxes t = min(max(dot(p, e) * inverse, Boxes(0.0f)), Boxes(1.0f));
    const Boxes3 way = p - e * t;
    return {way, dot(way, way)};
}
template <class Mask>
KERATIN_ALWAYS_INLINE Way select(const Mask& c, const Way& a, const Way& b) {
    return {select(c, a.way, b.way), select(c, a.square, b.square)};
}
KERATIN_ALWAYS_INLINE Way nearer(const Way& a, const Way& b) {
    return select(b.square < a.square, b, a);
}
KERATIN_ALWAYS_INLINE Way back(const Way& a) { return {-a.way, a.square}; }
KERATIN_ALWAYS_INLINE Boxes inverse(Boxes x) { return Boxes(1.0f) / max(x, Boxes(1e-30f)); }

// Two edges a lane, without their mean motion: w from the start of the second to that of the first,
// a and b along them; pa, pb, qa, qb the displacements of the first's and the second's ends.
struct Motion {
    Boxes3 w, a, b, pa, pb, qa, qb;
};

struct Room {
    Boxes now, least;  // m, the distance; what it certainly stays above
};

// For the rest of the step after t. rate: m, the most that the distance changes by in a whole step.
KERATIN_ALWAYS_INLINE Room room_after(const Motion& m, Boxes t, Boxes rate) {
    const Boxes none(0.0f), left = Boxes(1.0f) - t;
    const Boxes3 w = m.w + (m.pa - m.qa) * t, a = m.a + (m.pb - m.pa) * t,
                 b = m.b + (m.qb - m.qa) * t;
    const Boxes aa = dot(a, a), bb = dot(b, b);
    const Boxes inverse_aa = inverse(aa), inverse_bb = inverse(bb);
    // From the second edge to the first.
    Way way = nearer(way_to(w, b, inverse_bb), way_to(w + a, b, inverse_bb));
    way = nearer(way, back(way_to(-w, a, inverse_aa)));
    way = nearer(way, back(way_to(b - w, a, inverse_aa)));
    // Distance of the lines where their feet lie inside both segments.
    const Boxes ab = dot(a, b), aw = dot(a, w), bw = dot(b, w);
    const Boxes det = aa * bb - ab * ab;
    const Boxes s = ab * bw - bb * aw, u = aa * bw - ab * aw;
    const Boxes3 n = cross(a, b);
    const Boxes wn = dot(w, n), nn = dot(n, n);
    const Boxes share = wn * inverse(nn);
    // A foot just outside counts as inside, for rounding: the distance of the lines is never more
    // than that of the segments. Nearly parallel edges have no feet to speak of: their distance
    // falls short of that of the ends by no more than the sine times the shorter edge.
    const Boxes slack = Boxes(1e-3f) * det, sine_least = Boxes(1e-5f) * aa * bb;
    const auto inside =
        (sine_least <= det) & (-slack < s) & (s < det + slack) & (-slack < u) & (u < det + slack);
    way = select(inside, nearer(way, {n * share, wn * share}), way);
    const Boxes sag = select(det < sine_least, sqrt(nn * inverse(max(aa, bb))), none);
    // The smaller the sine, the more is lost of the lines' distance: four roundings of the numbers
    // that it is made of, over the sine.
    const Boxes lost = sqrt(Boxes(1.8e-13f) * (aa + bb + dot(w, w)) * (aa * bb * inverse(nn)));
    const Boxes d = sqrt(way.square) - sag - select(inside, lost, none);
    // Along any unit vector the edges are at least as far apart as their ends, now or at the end,
    // whichever is less: in between each pair of ends changes evenly.
    const Boxes3 unit = way.way * inverse(sqrt(way.square));
    const Boxes w0 = dot(unit, w), a0 = dot(unit, a), b0 = dot(unit, b);
    const Boxes start = w0 + min(a0, none) - max(b0, none);
    const Boxes end = min(w0 + dot(unit, m.pa) * left, w0 + a0 + dot(unit, m.pb) * left) -
                      max(dot(unit, m.qa) * left, b0 + dot(unit, m.qb) * left);
    return {d, max(d - rate * left, min(start, end))};
}

// Conservative advancement (METHODS 2.8).
std::uint32_t may_meet(const EdgePairs& pairs, const float* limits, int rounds) {
    const auto vector = [](const float(*numbers)[16], int from) {
        return load3<Boxes>(numbers[from], 0);
    };
    const Boxes limit = load<Boxes>(limits, 0);
    const Boxes3 first = vector(pairs.first, 0), second = vector(pairs.second, 0);
    Motion m{
        first - second,         vector(pairs.first, 3) - first, vector(pairs.second, 3) - second,
        vector(pairs.first, 6), vector(pairs.first, 9),         vector(pairs.second, 6),
        vector(pairs.second, 9)};
    const Boxes3 mean = (m.pa + m.pb + m.qa + m.qb) * Boxes(0.25f);
    m.pa -= mean, m.pb -= mean, m.qa -= mean, m.qb -= mean;
    const Boxes rate =
        sqrt(max(dot(m.pa, m.pa), dot(m.pb, m.pb))) + sqrt(max(dot(m.qa, m.qa), dot(m.qb, m.qb)));
    Boxes t(0.0f);
    std::uint32_t apart = 0;
    for (;;) {
        const Room room = room_after(m, t, rate);
        apart |= static_cast<std::uint32_t>(lane_bits(limit < room.least));
        const auto met = static_cast<std::uint32_t>(lane_bits(room.now <= limit));
        if (--rounds <= 0 || (apart | met) == 0xFFFFu) return ~apart & 0xFFFFu;
        t = min(t + max(room.now - limit, Boxes(0.0f)) * inverse(rate), Boxes(1.0f));
    }
}

constexpr SearchKernels kSearchKernels{&search_grid, &search_tree, &may_meet};

}  // namespace
}  // namespace keratin::KERATIN_ISA
