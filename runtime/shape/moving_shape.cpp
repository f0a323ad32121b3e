#include "runtime/shape/moving_shape.h"

#include "runtime/shape/closest.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace keratin {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;

Vector3 min_of(const Vector3& a, const Vector3& b) {
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
Vector3 max_of(const Vector3& a, const Vector3& b) {
    return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
double component(const Vector3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

SurfacePoint from_axis(const Vector3& axis_point, double radius, const Vector3& p,
                       const Vector3& axis) {
    const Vector3 w = p - axis_point;
    const double d = length(w);
    const double axis_length = length(axis);
    const Vector3 n = d > 0             ? (1 / d) * w
                      : axis_length > 0 ? any_perpendicular((1 / axis_length) * axis)
                                        : Vector3{0, 1, 0};
    return {axis_point + radius * n, n, d - radius};
}

SurfacePoint closest_on_box(const Vector3& centre, const Vector3& half, const Vector3& p) {
    const Vector3 w = p - centre;
    const Vector3 inside{std::clamp(w.x, -half.x, half.x), std::clamp(w.y, -half.y, half.y),
                         std::clamp(w.z, -half.z, half.z)};
    const Vector3 out = w - inside;
    const double d = length(out);
    if (d > 0) return {centre + inside, (1 / d) * out, d};
    const double depth[3] = {half.x - std::fabs(w.x), half.y - std::fabs(w.y),
                             half.z - std::fabs(w.z)};
    const int axis = static_cast<int>(std::min_element(depth, depth + 3) - depth);
    const double side = component(w, axis) < 0 ? -1 : 1;
    const Vector3 n{axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0};
    return {p + depth[axis] * n, n, -depth[axis]};
}

// Searches boxes of growing size around p until the closest triangle must lie inside the box.
SurfacePoint closest_on_mesh(const TriangleTree& tree, const Vector3& p) {
    const std::span<const Vector3> points = tree.points();
    const std::span<const std::uint32_t> triangles = tree.triangles();
    double best = std::numeric_limits<double>::infinity();
    Vector3 foot = p, face{0, 1, 0};
    double reach = 0;
    for (const Vector3& q : points) reach = std::max(reach, length(q - p));
    double size = reach / 256;
    while (size > 0) {
        const Vector3 r{size, size, size};
        tree.overlapping(p - r, p + r, [&](std::uint32_t t) {
            const Vector3 &a = points[triangles[3 * t]], &b = points[triangles[3 * t + 1]],
                          &c = points[triangles[3 * t + 2]];
            const TrianglePoint<double> near = closest_on_triangle(p, a, b, c);
            if (near.squared_distance < best) {
                best = near.squared_distance;
                foot = a + near.u * (b - a) + near.v * (c - a);
                face = cross(b - a, c - a);
            }
        });
        if (best <= size * size || size >= reach) break;
        size *= 4;
    }
    const double d = std::sqrt(best);
    if (d > 0 && d < std::numeric_limits<double>::infinity())
        return {foot, (1 / d) * (p - foot), d};
    const double n = length(face);
    return {foot, n > 0 ? (1 / n) * face : Vector3{0, 1, 0}, d};
}

}  // namespace

TriangleTree::TriangleTree(std::span<const Vector3> points,
                           std::span<const std::uint32_t> triangles)
    : points_(points.begin(), points.end()), triangles_(triangles.begin(), triangles.end()) {
    const std::uint32_t count = static_cast<std::uint32_t>(triangles.size() / 3);
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0u);
    auto corner = [&](std::uint32_t t, int k) -> const Vector3& {
        return points_[triangles_[3 * t + k]];
    };
    auto centre = [&](std::uint32_t t, int axis) {
        return component(corner(t, 0), axis) + component(corner(t, 1), axis) +
               component(corner(t, 2), axis);
    };

    struct Task {
        std::uint32_t node, first, count;
    };
    std::vector<Task> tasks;
    if (count > 0) {
        nodes_.push_back({});
        tasks.push_back({0, 0, count});
    }
    while (!tasks.empty()) {
        const Task task = tasks.back();
        tasks.pop_back();
        const double inf = std::numeric_limits<double>::infinity();
        Node node{{inf, inf, inf}, {-inf, -inf, -inf}, task.first, task.count};
        for (std::uint32_t i = 0; i < task.count; ++i)
            for (int k = 0; k < 3; ++k) {
                node.low = min_of(node.low, corner(order_[task.first + i], k));
                node.high = max_of(node.high, corner(order_[task.first + i], k));
            }
        if (task.count > kLeafTriangles) {
            const Vector3 size = node.high - node.low;
            const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
            const auto begin = order_.begin() + task.first;
            std::nth_element(begin, begin + task.count / 2, begin + task.count,
                             [&](std::uint32_t a, std::uint32_t b) {
                                 const double ca = centre(a, axis), cb = centre(b, axis);
                                 return ca < cb || (ca == cb && a < b);
                             });
            node.first = static_cast<std::uint32_t>(nodes_.size());
            node.count = 0;
            nodes_.resize(nodes_.size() + 2);
            tasks.push_back({node.first, task.first, task.count / 2});
            tasks.push_back(
                {node.first + 1, task.first + task.count / 2, task.count - task.count / 2});
        }
        nodes_[task.node] = node;
    }

    struct Half {
        std::uint32_t a, b, triangle, corner;
    };
    std::vector<Half> halves;
    for (std::uint32_t t = 0; t < count; ++t)
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t a = triangles_[3 * t + k], b = triangles_[3 * t + (k + 1) % 3];
            halves.push_back({std::min(a, b), std::max(a, b), t, triangles_[3 * t + (k + 2) % 3]});
        }
    std::sort(halves.begin(), halves.end(), [](const Half& l, const Half& r) {
        return l.a != r.a ? l.a < r.a : l.b != r.b ? l.b < r.b : l.triangle < r.triangle;
    });
    std::vector<std::pair<std::uint32_t, Edge>> owned;
    for (std::size_t i = 0; i < halves.size();) {
        std::size_t j = i + 1;
        while (j < halves.size() && halves[j].a == halves[i].a && halves[j].b == halves[i].b) ++j;
        owned.push_back({halves[i].triangle,
                         {{halves[i].a, halves[i].b}, {halves[i].corner, halves[j - 1].corner}}});
        i = j;
    }
    std::stable_sort(owned.begin(), owned.end(),
                     [](const auto& l, const auto& r) { return l.first < r.first; });
    edge_start_.assign(count + 1, 0);
    for (const auto& [triangle, edge] : owned) {
        ++edge_start_[triangle + 1];
        edges_.push_back(edge);
    }
    std::partial_sum(edge_start_.begin(), edge_start_.end(), edge_start_.begin());
}

SurfacePoint closest_on_shape(const RigidShape& shape, const Vector3& p) {
    switch (shape.kind) {
        case ShapeKind::plane: {
            const double d = dot(shape.b, p - shape.a);
            return {p - d * shape.b, shape.b, d};
        }
        case ShapeKind::sphere:
            return from_axis(shape.a, shape.radius, p, {0, 0, 0});
        case ShapeKind::capsule:
            return from_axis(mix(shape.a, shape.b, closest_on_segment(p, shape.a, shape.b)),
                             shape.radius, p, shape.b - shape.a);
        case ShapeKind::box:
            return closest_on_box(shape.a, shape.b, p);
        case ShapeKind::mesh:
            return closest_on_mesh(*shape.mesh, p);
    }
    return {};
}

}  // namespace keratin
