#include "runtime/contact/near_filter.h"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define KERATIN_CLONES [[gnu::target_clones("arch=skylake-avx512", "avx2", "default")]]
#else
#define KERATIN_CLONES
#endif

namespace keratin {
namespace {

constexpr int kLanes = 16;

struct Lanes {
    alignas(64) float first[12][kLanes], second[12][kLanes];
    alignas(64) float room[kLanes];  // m, what the edges certainly stay apart by in the step
};

// The way to point p from the nearest place of the segment from 0 along e, squared length ee.
struct Way {
    float x, y, z, square;
};
inline Way way_to(float px, float py, float pz, float ex, float ey, float ez, float ee) {
    const float d = px * ex + py * ey + pz * ez;
    float t = d / (ee > 1e-30f ? ee : 1e-30f);
    t = t < 0 ? 0 : t;
    t = t > 1 ? 1 : t;
    const float x = px - t * ex, y = py - t * ey, z = pz - t * ez;
    return {x, y, z, x * x + y * y + z * z};
}
inline Way nearer(const Way& a, const Way& b, bool b_counts) {
    const bool other = b_counts & (b.square < a.square);
    return {other ? b.x : a.x, other ? b.y : a.y, other ? b.z : a.z, other ? b.square : a.square};
}

KERATIN_CLONES void room_of(Lanes& n) {
    for (int l = 0; l < kLanes; ++l) {
        const float ax = n.first[3][l] - n.first[0][l], ay = n.first[4][l] - n.first[1][l],
                    az = n.first[5][l] - n.first[2][l];
        const float bx = n.second[3][l] - n.second[0][l], by = n.second[4][l] - n.second[1][l],
                    bz = n.second[5][l] - n.second[2][l];
        const float wx = n.first[0][l] - n.second[0][l], wy = n.first[1][l] - n.second[1][l],
                    wz = n.first[2][l] - n.second[2][l];
        const float aa = ax * ax + ay * ay + az * az, bb = bx * bx + by * by + bz * bz;
        // From the second edge to the first; -u and -v go the other way.
        Way way = way_to(wx, wy, wz, bx, by, bz, bb);
        way = nearer(way, way_to(wx + ax, wy + ay, wz + az, bx, by, bz, bb), true);
        const Way u = way_to(-wx, -wy, -wz, ax, ay, az, aa);
        const Way v = way_to(bx - wx, by - wy, bz - wz, ax, ay, az, aa);
        way = nearer(way, {-u.x, -u.y, -u.z, u.square}, true);
        way = nearer(way, {-v.x, -v.y, -v.z, v.square}, true);
        // Distance of the lines where their feet lie inside both segments.
        const float ab = ax * bx + ay * by + az * bz, aw = ax * wx + ay * wy + az * wz,
                    bw = bx * wx + by * wy + bz * wz;
        const float det = aa * bb - ab * ab;
        const float s = ab * bw - bb * aw, t = aa * bw - ab * aw;
        const float nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
        const float wn = wx * nx + wy * ny + wz * nz;
        const float nn = nx * nx + ny * ny + nz * nz;
        const float share = wn / (nn > 1e-30f ? nn : 1e-30f);
        // A foot just outside counts as inside, for rounding: the distance of the lines is never
        // more than that of the segments. Nearly parallel edges have no feet to speak of: their
        // distance falls short of that of the ends by no more than the sine times the shorter edge.
        const float slack = 1e-3f * det;
        const bool parallel = det < 1e-5f * aa * bb;
        const bool inside =
            !parallel & (s > -slack) & (s < det + slack) & (t > -slack) & (t < det + slack);
        way = nearer(way, {nx * share, ny * share, nz * share, wn * share}, inside);
        const float d = std::sqrt(way.square);
        const float longer = aa > bb ? aa : bb;
        const float sag = std::sqrt(nn / (longer > 1e-30f ? longer : 1e-30f));

        float mx = 0.25f * (n.first[6][l] + n.first[9][l] + n.second[6][l] + n.second[9][l]);
        float my = 0.25f * (n.first[7][l] + n.first[10][l] + n.second[7][l] + n.second[10][l]);
        float mz = 0.25f * (n.first[8][l] + n.first[11][l] + n.second[8][l] + n.second[11][l]);
        const float pax = n.first[6][l] - mx, pay = n.first[7][l] - my, paz = n.first[8][l] - mz;
        const float pbx = n.first[9][l] - mx, pby = n.first[10][l] - my, pbz = n.first[11][l] - mz;
        const float qax = n.second[6][l] - mx, qay = n.second[7][l] - my, qaz = n.second[8][l] - mz;
        const float qbx = n.second[9][l] - mx, qby = n.second[10][l] - my,
                    qbz = n.second[11][l] - mz;
        const float pa = pax * pax + pay * pay + paz * paz, pb = pbx * pbx + pby * pby + pbz * pbz;
        const float qa = qax * qax + qay * qay + qaz * qaz, qb = qbx * qbx + qby * qby + qbz * qbz;
        const float room = d - (parallel ? sag : 0.0f) - std::sqrt(pa > pb ? pa : pb) -
                           std::sqrt(qa > qb ? qa : qb);
        // Along any unit vector the edges are at least as far apart as their ends, at the start or
        // at the end, whichever is less: in between each pair of ends changes evenly.
        const float unit = 1 / (d > 1e-30f ? d : 1e-30f);
        const float ux = way.x * unit, uy = way.y * unit, uz = way.z * unit;
        const auto along = [&](float x, float y, float z) { return ux * x + uy * y + uz * z; };
        const float w0 = along(wx, wy, wz), a0 = along(ax, ay, az), b0 = along(bx, by, bz);
        const float start = w0 + (a0 < 0 ? a0 : 0) - (b0 > 0 ? b0 : 0);
        const float pa1 = w0 + along(pax, pay, paz), pb1 = w0 + a0 + along(pbx, pby, pbz);
        const float qa1 = along(qax, qay, qaz), qb1 = b0 + along(qbx, qby, qbz);
        const float end = (pa1 < pb1 ? pa1 : pb1) - (qa1 > qb1 ? qa1 : qb1);
        const float apart = start < end ? start : end;
        n.room[l] = apart > room ? apart : room;
    }
}

}  // namespace

void keep_near_pairs(std::span<const FilterEdge> edges, std::span<const BoxPair> pairs,
                     std::vector<BoxPair>& kept) {
    Lanes lanes;
    BoxPair waiting[kLanes];
    int count = 0;
    auto flush = [&] {
        for (int l = count; l < kLanes; ++l)
            for (int k = 0; k < 12; ++k) lanes.first[k][l] = lanes.second[k][l] = 0;
        room_of(lanes);
        for (int l = 0; l < count; ++l) {
            const FilterEdge &e = edges[waiting[l].first], &f = edges[waiting[l].second];
            const float limit = (e.half_distance + f.half_distance) * 1.002f + e.error + f.error;
            if (!(lanes.room[l] > limit)) kept.push_back(waiting[l]);
        }
        count = 0;
    };
    for (const BoxPair& p : pairs) {
        const FilterEdge &e = edges[p.first], &f = edges[p.second];
        if (p.second == p.first + 1 && e.strand == f.strand) continue;
        for (int k = 0; k < 12; ++k)
            lanes.first[k][count] = e.value[k], lanes.second[k][count] = f.value[k];
        waiting[count] = p;
        if (++count == kLanes) flush();
    }
    if (count > 0) flush();
}

}  // namespace keratin
