#include "tools/measure/strand_distance.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace keratin::measure {
namespace {

double clamped(double x) { return std::clamp(x, 0.0, 1.0); }

void note(Overlap& out, double depth, double delta, double tolerance, std::size_t first,
          std::size_t second) {
    if (depth > tolerance * delta) ++out.pairs;
    if (depth <= out.depth) return;
    out.depth = depth;
    out.first = first;
    out.second = second;
}

struct Edge {
    Point a, b;
    std::size_t strand;
    double arc;  // m, along the strand to its start
    double low[3], high[3];
};

std::vector<Edge> edges_of(const Strands& strands) {
    std::vector<Edge> edges;
    for (std::size_t s = 0; s < strands.count(); ++s) {
        const std::span<const Point> p = strands.strand(s);
        double arc = 0;
        for (std::size_t i = 0; i + 1 < p.size(); ++i) {
            Edge e{p[i], p[i + 1], s, arc, {}, {}};
            const double from[3] = {e.a.x, e.a.y, e.a.z}, to[3] = {e.b.x, e.b.y, e.b.z};
            for (int k = 0; k < 3; ++k)
                e.low[k] = std::min(from[k], to[k]), e.high[k] = std::max(from[k], to[k]);
            arc += distance(e.a, e.b);
            edges.push_back(e);
        }
    }
    return edges;
}

}  // namespace

// Minimises over one parameter with the other at its best, clamps, and once more the other way
// (Ericson, Real-Time Collision Detection, 5.1.9).
double segment_distance(Point a0, Point a1, Point b0, Point b1) {
    const Point d1 = a1 - a0, d2 = b1 - b0, w = a0 - b0;
    const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, w), c = dot(d1, w), b = dot(d1, d2);
    double s = 0, t = 0;
    if (a <= 0 && e <= 0) return length(w);
    if (a <= 0) {
        t = clamped(f / e);
    } else if (e <= 0) {
        s = clamped(-c / a);
    } else {
        const double denominator = a * e - b * b;
        s = denominator > 0 ? clamped((b * f - c * e) / denominator) : 0;
        t = (b * s + f) / e;
        if (t < 0) {
            t = 0;
            s = clamped(-c / a);
        } else if (t > 1) {
            t = 1;
            s = clamped((b - c) / a);
        }
    }
    return length(w + d1 * s - d2 * t);
}

Overlap overlap_between(const Strands& strands, std::span<const double> radius,
                        double contact_distance, double tolerance) {
    const std::vector<Edge> edges = edges_of(strands);
    Overlap out;
    if (edges.empty()) return out;
    // Sweep along the longest axis.
    double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
    for (const Edge& e : edges)
        for (int k = 0; k < 3; ++k)
            low[k] = std::min(low[k], e.low[k]), high[k] = std::max(high[k], e.high[k]);
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    const double widest =
        std::max(contact_distance, 2 * *std::max_element(radius.begin(), radius.end()));
    std::vector<std::uint32_t> order(edges.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t l, std::uint32_t r) {
        return edges[l].low[axis] < edges[r].low[axis];
    });
    const int second = (axis + 1) % 3, third = (axis + 2) % 3;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Edge& e = edges[order[i]];
        for (std::size_t j = i + 1;
             j < order.size() && edges[order[j]].low[axis] <= e.high[axis] + widest; ++j) {
            const Edge& f = edges[order[j]];
            if (f.low[second] > e.high[second] + widest ||
                f.high[second] < e.low[second] - widest || f.low[third] > e.high[third] + widest ||
                f.high[third] < e.low[third] - widest)
                continue;
            const double delta =
                contact_distance > 0 ? contact_distance : radius[e.strand] + radius[f.strand];
            if (e.strand == f.strand) {
                const Edge &before = e.arc < f.arc ? e : f, &after = e.arc < f.arc ? f : e;
                constexpr double kHalfTurn = 1.6;  // arc of a half circle over its diameter
                if (after.arc - before.arc - distance(before.a, before.b) < kHalfTurn * delta)
                    continue;
            }
            const double depth = delta - segment_distance(e.a, e.b, f.a, f.b);
            if (depth <= 0) continue;
            note(out, depth, delta, tolerance, std::min(order[i], order[j]),
                 std::max(order[i], order[j]));
            out.share = std::max(out.share, depth / delta);
        }
    }
    return out;
}

Overlap overlap_with(const Strands& strands, std::span<const double> radius, const Solid& solid,
                     double contact_distance, double tolerance, std::size_t skip) {
    Overlap out;
    std::size_t edge = 0;
    for (std::size_t s = 0; s < strands.count(); ++s) {
        const std::span<const Point> p = strands.strand(s);
        const double delta = contact_distance > 0 ? contact_distance : radius[s];
        for (std::size_t i = 0; i + 1 < p.size(); ++i, ++edge) {
            if (i < skip) continue;
            // The distance to a convex solid is convex along the edge: shrink the bracket of its
            // least.
            double low = 0, high = 1;
            auto at = [&](double t) {
                return signed_distance(solid, p[i] + (p[i + 1] - p[i]) * t);
            };
            for (int k = 0; k < 40; ++k) {
                const double l = low + (high - low) / 3, r = high - (high - low) / 3;
                (at(l) < at(r) ? high : low) = at(l) < at(r) ? r : l;
            }
            const double least = std::min({at(0), at(1), at(0.5 * (low + high))});
            const double depth = delta - least;
            if (depth <= 0) continue;
            note(out, depth, delta, tolerance, edge, edge);
            out.share = std::max(out.share, depth / delta);
        }
    }
    return out;
}

}  // namespace keratin::measure
