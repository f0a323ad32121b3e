// Strands for contact tests: chains of vertices with plain arrays behind ContactStrands.
#pragma once

#include "runtime/contact/contact.h"

#include <vector>

namespace keratin {

struct Chains {
    std::vector<Vector3> x_t0, x_t1;
    std::vector<std::uint32_t> first_vertex, strand;
    std::vector<double> radius;
    std::vector<std::uint8_t> prescribed;

    // A strand through the points; each moves by `move` within the step.
    void add(const std::vector<Vector3>& points, const Vector3& move, double r) {
        const std::uint32_t s = strand.empty() ? 0 : strand.back() + 1;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (i + 1 < points.size()) {
                first_vertex.push_back(static_cast<std::uint32_t>(x_t0.size()));
                strand.push_back(s);
                radius.push_back(r);
            }
            x_t0.push_back(points[i]);
            x_t1.push_back(points[i] + move);
            prescribed.push_back(0);
        }
    }

    ContactStrands view() const { return {x_t0, x_t1, first_vertex, strand, radius, prescribed}; }
};

}  // namespace keratin
