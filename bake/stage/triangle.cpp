#include "bake/stage/triangle.h"

#include <algorithm>

namespace keratin {
namespace {

TrianglePoint at(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, double u, double v,
                 double w) {
    TrianglePoint out;
    out.barycentric = {u, v, w};
    out.point = u * a + v * b + w * c;
    out.distance = (p - out.point).norm();
    return out;
}

double nearest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 ab = b - a;
    const double squared = ab.squaredNorm();
    return squared > 0 ? std::clamp((p - a).dot(ab) / squared, 0.0, 1.0) : 0.0;
}

TrianglePoint nearest_on_edges(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double t0 = nearest_on_segment(p, a, b);
    const double t1 = nearest_on_segment(p, b, c);
    const double t2 = nearest_on_segment(p, c, a);
    TrianglePoint best = at(p, a, b, c, 1 - t0, t0, 0);
    for (const TrianglePoint& q : {at(p, a, b, c, 0, 1 - t1, t1), at(p, a, b, c, t2, 0, 1 - t2)}) {
        if (q.distance < best.distance) best = q;
    }
    return best;
}

}  // namespace

TrianglePoint nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a, ap = p - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return at(p, a, b, c, 1, 0, 0);

    const Vec3 bp = p - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return at(p, a, b, c, 0, 1, 0);

    const Vec3 cp = p - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return at(p, a, b, c, 0, 0, 1);

    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    const double sum = va + vb + vc;
    // Below this the sign of va, vb, vc is rounding: the products they come from are of the size of
    // the product of the edges' squares.
    if (!(sum > 1e-14 * ab.squaredNorm() * ac.squaredNorm())) return nearest_on_edges(p, a, b, c);
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        const double t = d1 / (d1 - d3);
        return at(p, a, b, c, 1 - t, t, 0);
    }
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        const double t = d2 / (d2 - d6);
        return at(p, a, b, c, 1 - t, 0, t);
    }
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return at(p, a, b, c, 0, 1 - t, t);
    }
    const double v = vb / sum, w = vc / sum;
    return at(p, a, b, c, 1 - v - w, v, w);
}

}  // namespace keratin
