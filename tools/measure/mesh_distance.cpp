#include "tools/measure/mesh_distance.h"

#include <algorithm>
#include <limits>
#include <numbers>

namespace keratin::measure {

namespace {

constexpr std::uint32_t kLeafTriangles = 4;
// A group of triangles is taken as a dipole from this many of its radii on: the error of the whole
// sum stays below 0.02 (tested), far from the 0.5 that decides.
constexpr double kFar = 3;

Point min(Point a, Point b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Point max(Point a, Point b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
double component(Point p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

double square_to_box(Point x, Point low, Point high) {
    const Point d = max(max(low - x, x - high), {});
    return dot(d, d);
}

Point area_vector(const std::array<Point, 3>& t) { return cross(t[1] - t[0], t[2] - t[0]) * 0.5; }

Point middle(const std::array<Point, 3>& t) { return (t[0] + t[1] + t[2]) * (1.0 / 3); }

}  // namespace

Point nearest_on_triangle(Point x, const std::array<Point, 3>& t) {
    const Point ab = t[1] - t[0], ac = t[2] - t[0], ap = x - t[0];
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return t[0];
    const Point bp = x - t[1];
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return t[1];
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + ab * (d1 / (d1 - d3));
    const Point cp = x - t[2];
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return t[2];
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + ac * (d2 / (d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        return t[1] + (t[2] - t[1]) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    const double scale = 1 / (va + vb + vc);
    return t[0] + ab * (vb * scale) + ac * (vc * scale);
}

double winding_of_triangle(Point x, const std::array<Point, 3>& t) {
    const Point a = t[0] - x, b = t[1] - x, c = t[2] - x;
    const double la = length(a), lb = length(b), lc = length(c);
    const double volume = dot(a, cross(b, c));
    const double below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    return std::atan2(volume, below) / (2 * std::numbers::pi);
}

MeshDistance::MeshDistance(std::span<const Point> vertices,
                           std::span<const std::array<std::uint32_t, 3>> triangles) {
    double volume = 0;
    for (const auto& t : triangles) {
        const std::array<Point, 3> corners{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
        if (length(area_vector(corners)) > 0) corners_.push_back(corners);
    }
    if (corners_.empty()) return;
    nodes_.emplace_back();
    build(0, 0, static_cast<std::uint32_t>(corners_.size()));
    // About the middle of the mesh, a hole closed by a flat lid through it takes the least volume.
    for (const auto& t : corners_)
        volume +=
            dot(t[0] - nodes_[0].center, cross(t[1] - nodes_[0].center, t[2] - nodes_[0].center));
    facing_ = volume < 0 ? -1 : 1;
}

void MeshDistance::build(std::uint32_t index, std::uint32_t first, std::uint32_t count) {
    Node node;
    node.first = first;
    node.count = count;
    const double inf = std::numeric_limits<double>::infinity();
    node.low = {inf, inf, inf};
    node.high = {-inf, -inf, -inf};
    Point middle_low = node.low, middle_high = node.high;
    double total = 0;
    const auto here = std::span(corners_).subspan(first, count);
    for (const auto& t : here) {
        for (const Point& p : t) {
            node.low = min(node.low, p);
            node.high = max(node.high, p);
        }
        middle_low = min(middle_low, middle(t));
        middle_high = max(middle_high, middle(t));
        const Point area = area_vector(t);
        node.area = node.area + area;
        node.center = node.center + middle(t) * length(area);
        total += length(area);
    }
    node.center = node.center * (1 / total);
    for (const auto& t : here)
        for (const Point& p : t) node.radius = std::max(node.radius, distance(p, node.center));

    if (count > kLeafTriangles) {
        const Point extent = middle_high - middle_low;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                         : extent.y >= extent.z                       ? 1
                                                                      : 2;
        std::nth_element(here.begin(), here.begin() + count / 2, here.end(),
                         [axis](const auto& a, const auto& b) {
                             return component(middle(a), axis) < component(middle(b), axis);
                         });
        node.count = 0;
        node.child = static_cast<std::uint32_t>(nodes_.size());
        nodes_.resize(nodes_.size() + 2);
        build(node.child, first, count / 2);
        build(node.child + 1, first + count / 2, count - count / 2);
    }
    nodes_[index] = node;
}

double MeshDistance::unsigned_distance(Point x) const {
    if (empty()) return std::numeric_limits<double>::infinity();
    double best = std::numeric_limits<double>::infinity();
    std::array<std::pair<std::uint32_t, double>, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = {0, square_to_box(x, nodes_[0].low, nodes_[0].high)};
    while (depth > 0) {
        const auto [index, square] = stack[--depth];
        if (square >= best) continue;
        const Node& node = nodes_[index];
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const Point d = nearest_on_triangle(x, corners_[i]) - x;
            best = std::min(best, dot(d, d));
        }
        if (node.count > 0) continue;
        std::pair<std::uint32_t, double> near{node.child, 0}, far{node.child + 1, 0};
        near.second = square_to_box(x, nodes_[near.first].low, nodes_[near.first].high);
        far.second = square_to_box(x, nodes_[far.first].low, nodes_[far.first].high);
        if (far.second < near.second) std::swap(near, far);
        stack[depth++] = far;
        stack[depth++] = near;
    }
    return std::sqrt(best);
}

double MeshDistance::winding_number(Point x) const {
    if (empty()) return 0;
    double sum = 0;
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const Node& node = nodes_[stack[--depth]];
        const Point d = node.center - x;
        const double r = length(d);
        if (r > kFar * node.radius) {
            sum += dot(node.area, d) / (4 * std::numbers::pi * r * r * r);
        } else if (node.count > 0) {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
                sum += winding_of_triangle(x, corners_[i]);
        } else {
            stack[depth++] = node.child;
            stack[depth++] = node.child + 1;
        }
    }
    return facing_ * sum;
}

double MeshDistance::signed_distance(Point x) const {
    const double away = unsigned_distance(x);
    return winding_number(x) >= 0.5 ? -away : away;
}

}  // namespace keratin::measure
