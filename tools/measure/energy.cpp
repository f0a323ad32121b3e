#include "tools/measure/energy.h"

namespace keratin::measure {

namespace {

// v turned by the minimal rotation from unit a to unit b.
Point carry(Point a, Point b, Point v) {
    const double c = dot(a, b);
    if (1 + c < 1e-12) return v * -1;
    const Point k = cross(a, b);
    return v * c + cross(k, v) + k * (dot(k, v) / (1 + c));
}

// A frame as three axes, turned along with the direction of its strand.
struct Frame {
    Point axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    void carry_along(Point from, Point to) {
        for (Point& a : axis) a = carry(from, to, a);
    }
};

}  // namespace

std::vector<double> lumped_masses(const Strands& rest, std::span<const double> line_density) {
    std::vector<double> mass(rest.position.size());
    for (std::size_t s = 0; s < rest.count(); ++s)
        for (std::uint32_t p = rest.first_point[s] + 1; p < rest.first_point[s + 1]; ++p) {
            const double half =
                0.5 * line_density[s] * distance(rest.position[p], rest.position[p - 1]);
            mass[p - 1] += half;
            mass[p] += half;
        }
    return mass;
}

double kinetic_energy(std::span<const double> mass, std::span<const Point> velocity) {
    double sum = 0;
    for (std::size_t p = 0; p < mass.size(); ++p)
        sum += 0.5 * mass[p] * dot(velocity[p], velocity[p]);
    return sum;
}

double potential_energy(std::span<const double> mass, std::span<const Point> position,
                        Point gravity) {
    double sum = 0;
    for (std::size_t p = 0; p < mass.size(); ++p) sum -= mass[p] * dot(gravity, position[p]);
    return sum;
}

double stretch_energy(const Strands& strands, const Strands& rest,
                      std::span<const double> stiffness) {
    double sum = 0;
    for (std::size_t s = 0; s < strands.count(); ++s) {
        const auto now = strands.strand(s), then = rest.strand(s);
        for (std::size_t p = 1; p < now.size(); ++p) {
            const double rest_length = distance(then[p], then[p - 1]);
            if (rest_length <= 0) continue;
            const double strain = distance(now[p], now[p - 1]) / rest_length - 1;
            sum += 0.5 * stiffness[s] * strain * strain * rest_length;
        }
    }
    return sum;
}

double bend_energy(const Strands& strands, const Strands& rest, std::span<const Rigid> root,
                   std::span<const double> stiffness) {
    double sum = 0;
    for (std::size_t s = 0; s < strands.count(); ++s) {
        const auto now = strands.strand(s), then = rest.strand(s);
        Frame frame_rest, frame;
        for (Point& a : frame.axis) a = turn(root[s], a);
        Point t_rest, t;  // direction of the segment that the frame stands on
        double parent = 0;
        for (std::size_t p = 1; p < now.size(); ++p) {
            const Point e_rest = then[p] - then[p - 1], e = now[p] - now[p - 1];
            const double l = length(e_rest);
            if (l <= 0 || length(e) <= 0) break;
            if (p == 1) {
                // The root turns the first segment along; what it deviates by is no bend here.
                frame.carry_along(turn(root[s], e_rest * (1 / l)), e * (1 / length(e)));
            } else {
                Point wanted;
                for (int c = 0; c < 3; ++c)
                    wanted = wanted + frame.axis[c] * dot(frame_rest.axis[c], e_rest);
                const Point miss = e - wanted;
                const double alpha = 0.5 * (parent + l) * l * l / stiffness[s];
                sum += 0.5 * dot(miss, miss) / alpha;
                frame_rest.carry_along(t_rest, e_rest * (1 / l));
                frame.carry_along(t, e * (1 / length(e)));
            }
            t_rest = e_rest * (1 / l);
            t = e * (1 / length(e));
            parent = l;
        }
    }
    return sum;
}

}  // namespace keratin::measure
