#include "bake/stage/rest_frame.h"

#include "schema/formula/frame.h"

#include <cstddef>

namespace keratin {

void rest_frames(std::span<const double> points, std::span<const double, 3> normal,
                 std::span<double> lengths, std::span<double> shapes) {
    using V = Vec3<double>;
    const auto at = [&](std::size_t p) {
        return V(points[3 * p], points[3 * p + 1], points[3 * p + 2]);
    };
    const auto store = [&](std::size_t p, const V& v) {
        shapes[3 * p] = v.x;
        shapes[3 * p + 1] = v.y;
        shapes[3 * p + 2] = v.z;
    };
    const V x(1, 0, 0);
    V t = normalize_or(at(1) - at(0), x);
    V u = orthonormal_director(t, V(normal[0], normal[1], normal[2]));
    lengths[0] = 0;
    store(0, u);
    for (std::size_t p = 1; p < lengths.size(); ++p) {
        const V edge = at(p) - at(p - 1);
        lengths[p] = length(edge);
        store(p, to_frame(t, u, edge));
        const V next = normalize_or(edge, t);
        u = transport_director(t, next, u);
        t = next;
    }
}

}  // namespace keratin
