#include "runtime/contact/meeting.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

constexpr double kParallel = 1e-2;      // squared sine; about 6 degrees
constexpr double kOverlapReach = 1.05;  // of delta: an end of a parallel overlap this near counts

// Unit vector from q(t) to p(s); where they coincide, perpendicular to both, on the side of x_t.
Vector3 normal_between(const MovingSegment& p, const MovingSegment& q, double s, double t,
                       const Vector3& start_side) {
    const Vector3 w = mix(p.a, p.b, s) - mix(q.a, q.b, t);
    const double d = length(w);
    if (d > kTouching) return w * (1 / d);
    const Vector3 ep = p.b - p.a, eq = q.b - q.a;
    Vector3 n = cross(ep, eq);
    const double nn = length(n), scale = length(ep) * length(eq);
    if (nn > 1e-6 * scale && nn > 0) {
        n *= 1 / nn;
    } else {
        const double l = length(ep);
        n = l > 0 ? any_perpendicular(ep * (1 / l)) : Vector3(0, 1, 0);
    }
    return dot(n, start_side) < 0 ? -n : n;
}

// Moves a closest point to the end of its segment where that is as near, to the slack (m): beside a
// joint both edges then have the same contact, at the vertex, and not two that hardly differ.
SegmentPair<double> snapped_to_ends(const MovingSegment& p, const MovingSegment& q,
                                    SegmentPair<double> pair, double slack) {
    const double reach = std::sqrt(pair.squared_distance) + slack;
    for (const double end : {0.0, 1.0}) {
        const Vector3 x = end > 0 ? p.b : p.a;
        const double t = closest_on_segment(x, q.a, q.b);
        const double along = (end - pair.s) * (end - pair.s) * squared_length(p.b - p.a);
        if (pair.s == end || along > reach * reach ||
            squared_length(x - mix(q.a, q.b, t)) > reach * reach)
            continue;
        pair.s = end;
        pair.t = t;
        break;
    }
    for (const double end : {0.0, 1.0}) {
        const Vector3 y = end > 0 ? q.b : q.a;
        const double s = pair.s <= 0 || pair.s >= 1 ? pair.s : closest_on_segment(y, p.a, p.b);
        const double along = (end - pair.t) * (end - pair.t) * squared_length(q.b - q.a);
        if (pair.t == end || along > reach * reach ||
            squared_length(y - mix(p.a, p.b, s)) > reach * reach)
            continue;
        pair.t = end;
        pair.s = s;
        break;
    }
    return pair;
}

// The places where segments p and q, as they stand, are in contact: one, or both ends of the
// overlap of nearly parallel ones.
void meet_at(const MovingSegment& p, const MovingSegment& q, double delta, double slack,
             const Vector3& start_side, Meetings& out) {
    const SegmentPair<double> pair = closest_segments(p.a, p.b, q.a, q.b);
    const double reach = kOverlapReach * delta;
    out.count = 0;
    auto add = [&](double s, double t) {
        if (out.count < 3) out.at[out.count++] = {s, t, normal_between(p, q, s, t, start_side)};
    };
    const Vector3 ep = p.b - p.a, eq = q.b - q.a;
    const double pp = squared_length(ep), qq = squared_length(eq);
    const Vector3 n = cross(ep, eq);
    if (pp > 0 && qq > 0 && squared_length(n) < kParallel * pp * qq) {
        double s0 = dot(q.a - p.a, ep) / pp, s1 = dot(q.b - p.a, ep) / pp;
        const bool same_way = s0 <= s1;
        if (!same_way) std::swap(s0, s1);
        const double low = std::max(0.0, s0), high = std::min(1.0, s1);
        // Ends of the overlap: an end of p with its foot on q, or an end of q with its foot on p.
        if ((high - low) * std::sqrt(pp) > reach) {
            auto offer = [&](double s, bool end_of_p, double t_of_q) {
                const double t = end_of_p ? closest_on_segment(mix(p.a, p.b, s), q.a, q.b) : t_of_q;
                const double d2 = squared_length(mix(p.a, p.b, s) - mix(q.a, q.b, t));
                if (d2 > reach * reach) return;
                const SegmentPair<double> place = snapped_to_ends(p, q, {s, t, d2}, slack);
                add(place.s, place.t);
            };
            offer(low, s0 <= 0, same_way ? 0.0 : 1.0);
            offer(high, s1 >= 1, same_way ? 1.0 : 0.0);
            const bool crossing = pair.s > 0 && pair.s < 1 && pair.t > 0 && pair.t < 1;
            if (crossing || out.count == 0) add(pair.s, pair.t);
            return;
        }
    }
    const SegmentPair<double> place = snapped_to_ends(p, q, pair, slack);
    add(place.s, place.t);
}

}  // namespace

Meetings meet_segments(const MovingSegment& p, const MovingSegment& q, double delta, double slack) {
    Meetings out;
    const FirstContact first = first_segment_contact(p, q, delta);
    out.start_distance = first.start_distance;
    out.time = first.time;
    if (!first.found) return out;
    const SegmentPair<double> start = closest_segments(p.a, p.b, q.a, q.b);
    const Vector3 start_side = mix(p.a, p.b, start.s) - mix(q.a, q.b, start.t);
    meet_at(at_time(p, first.time), at_time(q, first.time), delta, slack, start_side, out);
    return out;
}

bool apart_at_start(const MovingSegment& p, const MovingSegment& q, double s, double t,
                    const Vector3& normal, double distance) {
    return dot(normal, mix(p.a, p.b, s) - mix(q.a, q.b, t)) >= 0.5 * distance;
}

bool meet_deeper(const MovingSegment& p, const MovingSegment& q, double distance, Meeting& out) {
    if (!(distance > 0)) return false;
    const FirstContact first = first_segment_contact(p, q, distance);
    if (!first.found) return false;
    const MovingSegment pt = at_time(p, first.time), qt = at_time(q, first.time);
    const SegmentPair<double> pair = closest_segments(pt.a, pt.b, qt.a, qt.b);
    const Vector3 w = mix(pt.a, pt.b, pair.s) - mix(qt.a, qt.b, pair.t);
    const double d = length(w);
    if (d < kTouching) return false;
    out = {pair.s, pair.t, w * (1 / d)};
    return true;
}

bool meet_at_end(const MovingSegment& p, const MovingSegment& q, double reach, double delta,
                 double tolerance, const Meetings& first, Meeting& out) {
    const double target = std::min(reach, first.start_distance + 0.2 * delta) - tolerance * delta;
    const MovingSegment p1 = at_time(p, 1), q1 = at_time(q, 1);
    const SegmentPair<double> pair = closest_segments(p1.a, p1.b, q1.a, q1.b);
    if (pair.squared_distance >= target * target || pair.squared_distance < kTouching * kTouching)
        return false;
    const Vector3 n = normal_between(p1, q1, pair.s, pair.t, first.at[0].normal);
    constexpr double kSameSide = 0.2;  // cosine; less may have passed through
    if (dot(n, first.at[0].normal) < kSameSide ||
        !apart_at_start(p, q, pair.s, pair.t, n, std::min(reach, first.start_distance)))
        return meet_deeper(p, q, std::min(reach, first.start_distance) - kOverlaps * delta, out);
    out = {pair.s, pair.t, n};
    return true;
}

bool ends_nearer(const MovingSegment& p, const MovingSegment& q, double reach, double depth,
                 SegmentPair<double>& end) {
    const MovingSegment p1 = at_time(p, 1), q1 = at_time(q, 1);
    end = closest_segments(p1.a, p1.b, q1.a, q1.b);
    const double distance = std::sqrt(end.squared_distance);
    if (distance >= reach - depth) return false;
    return distance < std::sqrt(closest_segments(p.a, p.b, q.a, q.b).squared_distance) - depth;
}

std::uint32_t parts_of_first(const MovingSegment& p, const MovingSegment& q, double delta) {
    constexpr double kApart = 4;  // of delta: ends of edges that cross by more are not in contact
    constexpr double kShortest = 4;  // of delta: a part
    constexpr std::uint32_t kMost = 4;
    const Vector3 ep = p.b - p.a, eq = q.b - q.a;
    const double pp = squared_length(ep), qq = squared_length(eq);
    const double apart = kApart * delta;
    if (squared_length(cross(ep, eq)) > apart * apart * qq) return 1;
    return std::clamp(
        static_cast<std::uint32_t>(std::min(std::sqrt(pp) / (kShortest * delta), 1e3)), 1u, kMost);
}

MovingSegment world_edge(const ContactStrands& strands, std::uint32_t edge) {
    const std::uint32_t v = strands.first_vertex[edge];
    const Vector3 &a = strands.x_t0[v], &b = strands.x_t0[v + 1];
    return {a, b, strands.x_t1[v] - a, strands.x_t1[v + 1] - b};
}

MovingSegment world_axis(const MovingShape& c) {
    const Vector3 b = c.shape.kind == ShapeKind::capsule ? c.shape.b : c.shape.a;
    const Vector3 a0 = to_world(c.pose_t0, c.shape.a), b0 = to_world(c.pose_t0, b);
    return {a0, b0, to_world(c.pose_t1, c.shape.a) - a0, to_world(c.pose_t1, b) - b0};
}

EdgePlace file_under(const ContactStrands& strands, std::uint32_t edge, double parameter) {
    if (parameter >= 1 && edge + 1 < strands.edge_count() &&
        strands.strand[edge + 1] == strands.strand[edge])
        return {edge + 1, 0.0, true, true};
    return {edge, parameter, parameter <= 0, false};
}

bool can_move(const ContactStrands& strands, std::uint32_t edge, double parameter) {
    constexpr double kBeside = 0.05;
    const std::uint32_t v = strands.first_vertex[edge];
    return !((strands.prescribed[v] || parameter >= 1 - kBeside) &&
             (strands.prescribed[v + 1] || parameter <= kBeside));
}

}  // namespace keratin
