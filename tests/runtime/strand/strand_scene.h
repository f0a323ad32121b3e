// What the tests of the strand solver share: scenes, and what is measured on a simulation.
#pragma once

#include "runtime/simulation.h"
#include "schema/formula/quaternion.h"
#include "tools/scenes/groom.h"

#include <array>
#include <cmath>
#include <vector>

namespace keratin::test {

using Point = std::array<double, 3>;

inline double distance(const Point& a, const Point& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Lanes with points, in order.
inline std::vector<std::uint32_t> lanes_of(const Simulation& s) {
    std::vector<std::uint32_t> lanes;
    for (std::uint32_t i = 0; i < s.fields().guide_point_count.size(); ++i)
        if (s.fields().guide_point_count[i] > 0) lanes.push_back(i);
    return lanes;
}

inline Point at(const Simulation& s, std::span<const float> tiled, std::uint32_t lane,
                std::uint32_t p) {
    const std::size_t row = s.fields().tile_first_row[lane / kTileLanes] + p;
    Point x;
    for (std::size_t c = 0; c < 3; ++c)
        x[c] = double(tiled[vector_index(row, 3, c, lane % kTileLanes)]);
    return x;
}
inline Point point(const Simulation& s, std::uint32_t lane, std::uint32_t p) {
    return at(s, s.guides().position, lane, p);
}
inline Point rest_point(const Simulation& s, std::uint32_t lane, std::uint32_t p) {
    return at(s, s.fields().guide_position, lane, p);
}
inline std::uint32_t points_of(const Simulation& s, std::uint32_t lane) {
    return s.fields().guide_point_count[lane];
}
inline Point tip(const Simulation& s, std::uint32_t lane) {
    return point(s, lane, points_of(s, lane) - 1);
}

inline Point carried(const RigidTransform& t, const Point& x) {
    const Vec3<double> r =
        rotate(Vec4<double>(t.rotation[0], t.rotation[1], t.rotation[2], t.rotation[3]),
               Vec3<double>(x[0], x[1], x[2]));
    return {r.x + t.translation[0], r.y + t.translation[1], r.z + t.translation[2]};
}

// Largest ||e| / rest - 1| over all segments.
inline double stretch(const Simulation& s) {
    double worst = 0;
    for (std::uint32_t lane : lanes_of(s))
        for (std::uint32_t p = 1; p < points_of(s, lane); ++p) {
            const std::size_t row = s.fields().tile_first_row[lane / kTileLanes] + p;
            const double rest =
                double(s.fields().guide_length[scalar_index(row, lane % kTileLanes)]);
            const double now = distance(point(s, lane, p), point(s, lane, p - 1));
            worst = std::max(worst, std::fabs(now / rest - 1));
        }
    return worst;
}

inline double speed(const Simulation& s, std::uint32_t lane, std::uint32_t p) {
    return distance(point(s, lane, p), at(s, s.guides().previous, lane, p)) /
           s.guides().previous_step;
}

// Mean distance of all guide points from the groom at rest carried by the roots.
inline double away_from_rest(const Simulation& s) {
    double sum = 0, count = 0;
    for (std::uint32_t lane : lanes_of(s))
        for (std::uint32_t p = 0; p < points_of(s, lane); ++p) {
            sum += distance(point(s, lane, p), carried(s.guide_root(lane), rest_point(s, lane, p)));
            ++count;
        }
    return sum / count;
}

// The demo's motion: yaw of 40 degrees and 10 cm sideways at 1 Hz.
inline RigidTransform shaken(double t) {
    constexpr double pi = 3.14159265358979323846;
    const double yaw = 40 * pi / 180 * std::sin(2 * pi * t);
    return {{0.1 * std::sin(2 * pi * t), 0, 0}, {0, std::sin(yaw / 2), 0, std::cos(yaw / 2)}};
}

inline void must(const Result<void>& r) {
    if (!r) throw std::runtime_error(to_string(r.error()));
}
inline Simulation made(const scenes::Groom& g, const Settings& settings) {
    auto s = Simulation::create(g.info, g.fields, settings);
    if (!s) throw std::runtime_error(to_string(s.error()));
    return std::move(*s);
}
inline void run(Simulation& s, double seconds, double h) {
    for (int i = 0; i < int(std::lround(seconds / h)); ++i) must(s.step(h));
}

// A head of hair: guides on a sphere of 10 cm, every `guide_every`-th strand a guide.
inline scenes::Groom head(std::uint32_t strands, std::uint32_t points, double length,
                          scenes::GroomOptions options = {}) {
    return scenes::make_groom(scenes::hair_on_sphere(strands, points, 0.1, length, 0.005), options);
}

inline Settings single_thread() {
    Settings s;
    s.threads = 1;
    return s;
}

}  // namespace keratin::test
