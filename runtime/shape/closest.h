// Closest points between points, segments and triangles, in the accuracy of Real. Degenerate input
// (a segment or triangle without extent) is allowed.
#pragma once

#include "runtime/shape/vector3.h"

#include <algorithm>

namespace keratin {

// Parameter in [0, 1] of the point of segment a b that is closest to p.
template <class Real>
Real closest_on_segment(const Vec3<Real>& p, const Vec3<Real>& a, const Vec3<Real>& b) {
    const Vec3<Real> e = b - a;
    const Real ee = dot(e, e);
    return ee > 0 ? std::clamp(dot(p - a, e) / ee, Real(0), Real(1)) : Real(0);
}

template <class Real>
struct SegmentPair {
    Real s, t;              // parameters of the closest points on the first and the second segment
    Real squared_distance;  // m^2
};

// Closest points of segments a0 a1 and b0 b1: the smallest of the four distances from an end point
// to the other segment, and of the distance between the lines where both of its feet lie inside.
// Where several pairs are equally close (parallel overlap) the one found first in that order.
template <class Real>
SegmentPair<Real> closest_segments(const Vec3<Real>& a0, const Vec3<Real>& a1, const Vec3<Real>& b0,
                                   const Vec3<Real>& b1) {
    const Vec3<Real> ea = a1 - a0, eb = b1 - b0, w = a0 - b0;
    SegmentPair<Real> best;
    auto offer = [&](Real s, Real t) {
        const Real d2 = squared_length(w + s * ea - t * eb);
        if (d2 < best.squared_distance) best = {s, t, d2};
    };
    best = {Real(0), closest_on_segment(a0, b0, b1), Real(0)};
    best.squared_distance = squared_length(w - best.t * eb);
    offer(Real(1), closest_on_segment(a1, b0, b1));
    offer(closest_on_segment(b0, a0, a1), Real(0));
    offer(closest_on_segment(b1, a0, a1), Real(1));
    const Real aa = dot(ea, ea), bb = dot(eb, eb), ab = dot(ea, eb), aw = dot(ea, w),
               bw = dot(eb, w);
    const Real det = aa * bb - ab * ab;
    if (det > 0) {
        const Real s = ab * bw - bb * aw, t = aa * bw - ab * aw;
        if (s > 0 && s < det && t > 0 && t < det) offer(s / det, t / det);
    }
    return best;
}

template <class Real>
struct TrianglePoint {
    Real u, v;              // the point is (1 - u - v) a + u b + v c
    Real squared_distance;  // m^2
};

// Point of triangle a b c that is closest to p: the foot of the perpendicular when it lies inside,
// else the closest of the three edges.
template <class Real>
TrianglePoint<Real> closest_on_triangle(const Vec3<Real>& p, const Vec3<Real>& a,
                                        const Vec3<Real>& b, const Vec3<Real>& c) {
    const Vec3<Real> e = b - a, f = c - a, w = p - a;
    const Vec3<Real> n = cross(e, f);
    const Real nn = dot(n, n);
    if (nn > 0) {
        const Real u = dot(cross(w, f), n) / nn, v = dot(cross(e, w), n) / nn;
        if (u >= 0 && v >= 0 && u + v <= 1) return {u, v, squared_length(w - u * e - v * f)};
    }
    const Real s = closest_on_segment(p, a, b), t = closest_on_segment(p, a, c),
               r = closest_on_segment(p, b, c);
    TrianglePoint<Real> best{s, Real(0), squared_length(w - s * e)};
    const Real dt = squared_length(w - t * f);
    if (dt < best.squared_distance) best = {Real(0), t, dt};
    const Real dr = squared_length(w - (1 - r) * e - r * f);
    if (dr < best.squared_distance) best = {1 - r, r, dr};
    return best;
}

}  // namespace keratin
