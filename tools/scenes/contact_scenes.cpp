#include "tools/scenes/contact_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace keratin::scenes {
namespace {

constexpr double kRadius = 5e-5;              // m
constexpr double kHairballDistance = 110e-6;  // m, strand on strand

RodMaterial hair() {
    RodMaterial m;
    m.radii = {kRadius, kRadius};
    m.density = 1320;
    m.youngs_modulus = 0.8e9;
    m.poisson_ratio = 0.36;
    return m;
}

using Vector = std::array<double, 3>;
Vector at(const Vector& from, const Vector& direction, double s) {
    return {from[0] + s * direction[0], from[1] + s * direction[1], from[2] + s * direction[2]};
}

std::vector<Double3> straight(const Vector& from, const Vector& direction, double length,
                              std::uint32_t vertices) {
    std::vector<Double3> points;
    for (std::uint32_t i = 0; i < vertices; ++i)
        points.push_back(at(from, direction, length * i / (vertices - 1)));
    return points;
}

// Places of a bundle's strands across it: a hexagonal lattice of the given pitch around the axis.
std::vector<std::array<double, 2>> lattice(std::uint32_t count, double pitch) {
    std::vector<std::array<double, 2>> places;
    for (int ring = 0; places.size() < count; ++ring) {
        places.clear();
        for (int i = -ring; i <= ring; ++i)
            for (int j = -ring; j <= ring; ++j)
                if (std::abs(i + j) <= ring)
                    places.push_back({pitch * (i + 0.5 * j), pitch * std::sqrt(0.75) * j});
    }
    std::stable_sort(places.begin(), places.end(), [](const auto& l, const auto& r) {
        return l[0] * l[0] + l[1] * l[1] < r[0] * r[0] + r[1] * r[1];
    });
    places.resize(count);
    return places;
}

RodStrand strand(std::vector<Double3> points, RodEnd root, RodEnd tip) {
    RodStrand s;
    s.points = std::move(points);
    s.material = hair();
    s.root = root;
    s.tip = tip;
    return s;
}

constexpr double kPitch = 3 * kRadius;  // between strands of a bundle: half a diameter apart

// Two planes through the axis turned against each other by `angle` about the normal.
Vector tilted(const Vector& v, double angle) {
    return {v[0], v[1] * std::cos(angle) - v[2] * std::sin(angle),
            v[1] * std::sin(angle) + v[2] * std::cos(angle)};
}

}  // namespace

ContactScene bundle_on_bundle(std::uint32_t strands_each) {
    ContactScene scene;
    scene.name = "bundle_on_bundle";
    const auto places = lattice(strands_each, kPitch);
    for (const auto& [u, v] : places)
        scene.strands.push_back(
            strand(straight({-0.05, u, v}, {1, 0, 0}, 0.1, 21), RodEnd::clamped, RodEnd::clamped));
    for (const auto& [u, v] : places)
        scene.strands.push_back(strand(straight({u, 0.004 + v, -0.03}, {0, 0, 1}, 0.08, 21),
                                       RodEnd::clamped, RodEnd::free));
    scene.duration = 0.5;
    scene.least_contacts = 10 * strands_each;
    return scene;
}

ContactScene bundle_on_cylinder(std::uint32_t strands) {
    ContactScene scene;
    scene.name = "bundle_on_cylinder";
    constexpr double radius = 0.01;
    for (const auto& [u, v] : lattice(strands, kPitch))
        scene.strands.push_back(strand(straight({-0.02, radius + 0.003 + u, v}, {1, 0, 0}, 0.1, 26),
                                       RodEnd::clamped, RodEnd::free));
    scene.colliders.push_back(
        {{ShapeKind::capsule, {0, 0, -1}, {0, 0, 1}, radius, nullptr}, 0.3, 0, {}});
    scene.solids.push_back(measure::Capsule{{0, 0, -1}, {0, 0, 1}, radius});
    scene.duration = 0.5;
    scene.least_contacts = 10 * strands;
    return scene;
}

ContactScene bundle_on_ground(std::uint32_t strands) {
    ContactScene scene;
    scene.name = "bundle_on_ground";
    const double slant = 0.5;
    for (const auto& [u, v] : lattice(strands, kPitch)) {
        const Vector along{std::cos(slant), std::sin(slant), 0};
        const Vector from{-u * along[1], 0.003 + u * along[0], v};
        scene.strands.push_back(
            strand(straight(from, along, 0.06, 16), RodEnd::free, RodEnd::free));
    }
    scene.colliders.push_back({{ShapeKind::plane, {0, 0, 0}, {0, 1, 0}, 0, nullptr}, 0.3, 0, {}});
    scene.solids.push_back(measure::Plane{{0, 0, 0}, {0, 1, 0}});
    scene.duration = 1;
    scene.least_contacts = 10 * strands;
    return scene;
}

ContactScene strand_on_strand(double friction) {
    ContactScene scene;
    scene.name = "strand_on_strand";
    scene.strands.push_back(
        strand(straight({-0.05, 0, 0}, {1, 0, 0}, 0.1, 21), RodEnd::clamped, RodEnd::clamped));
    scene.strands.push_back(strand(straight({0.003, 0.002, -0.03}, {0, 0, 1}, 0.08, 21),
                                   RodEnd::clamped, RodEnd::free));
    scene.contact.friction = friction;
    scene.duration = 0.5;
    scene.least_contacts = 1;
    return scene;
}

ContactScene strand_on_pipe(double friction) {
    ContactScene scene;
    scene.name = "strand_on_pipe";
    constexpr double radius = 0.01, angle = 20 * std::numbers::pi / 180;
    const Vector axis = tilted({0, 0, 1}, angle), up = tilted({0, 1, 0}, angle);
    scene.strands.push_back(
        strand(straight(at({-0.03, 0, 0}, up, radius + 1e-3), {1, 0, 0}, 0.06, 31), RodEnd::free,
               RodEnd::free));
    const Vector a = at({0, 0, 0}, axis, -1), b = at({0, 0, 0}, axis, 1);
    scene.colliders.push_back(
        {{ShapeKind::capsule, {a[0], a[1], a[2]}, {b[0], b[1], b[2]}, radius, nullptr},
         friction,
         0,
         {}});
    scene.solids.push_back(measure::Capsule{{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, radius});
    scene.contact.friction = friction;
    scene.duration = 0.3;
    scene.least_contacts = 2;
    return scene;
}

ContactScene two_strands() {
    ContactScene scene;
    scene.name = "two_strands";
    scene.strands.push_back(
        strand(straight({-0.02, 0, 0}, {1, 0, 0}, 0.04, 9), RodEnd::clamped, RodEnd::clamped));
    RodStrand falling = strand(straight({0.003, 3 * kRadius, -0.01}, {0, 0, 1}, 0.02, 5),
                               RodEnd::free, RodEnd::free);
    falling.velocities.assign(falling.points.size(), {0.05, -0.3, 0});
    scene.strands.push_back(falling);
    scene.duration = 0.002;
    scene.least_contacts = 1;
    return scene;
}

double hairball_angle(double t) {
    // The speed rises by a smoothstep over a third of the time, is even for a third, and falls the
    // same way: 3 s^2 - 2 s^3 integrates to s^3 - s^4 / 2.
    constexpr double start = 0.5, end = 4.0, ramp = (end - start) / 3;
    const double whole = 2 * ramp;  // integral of the speed's shape
    auto rise = [&](double s) { return ramp * (s * s * s - 0.5 * s * s * s * s); };
    double done = 0;
    if (t <= start) return 0;
    if (t >= end)
        done = whole;
    else if (t < start + ramp)
        done = rise((t - start) / ramp);
    else if (t < end - ramp)
        done = 0.5 * ramp + (t - start - ramp);
    else
        done = whole - rise((end - t) / ramp);
    return 2 * std::numbers::pi * done / whole;
}

ContactScene hairball(const HairballOptions& options) {
    ContactScene scene;
    scene.name = "hairball";
    constexpr double radius = 0.15, length = 0.20;
    std::mt19937_64 random(2011);
    auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    // Roots nearer than this would hold strands inside each other for good.
    constexpr double kLeastDistance = 3 * kHairballDistance;
    std::vector<Vector> roots_taken;
    while (scene.strands.size() < options.strands) {
        const double y = unit(), angle = 2 * std::numbers::pi * unit(),
                     across = std::sqrt(1 - y * y);
        const Vector n{across * std::cos(angle), y, across * std::sin(angle)};
        const bool taken =
            std::any_of(roots_taken.begin(), roots_taken.end(), [&](const Vector& o) {
                return radius * std::hypot(n[0] - o[0], n[1] - o[1], n[2] - o[2]) < kLeastDistance;
            });
        if (taken) continue;
        roots_taken.push_back(n);
        scene.strands.push_back(strand(
            straight(at({0, 0, 0}, n, radius), n, length, options.vertices),
            options.as_published ? RodEnd::clamped_two_points : RodEnd::clamped, RodEnd::free));
    }
    if (options.as_published) scene.rod.stretch_scale = 0.01;
    ContactCollider sphere{
        {ShapeKind::sphere, {0, 0, 0}, {0, 0, 0}, radius, nullptr}, 0.3, 55e-6, {}};
    sphere.pose = [](double t) {
        const double half = 0.5 * hairball_angle(t);
        return make_pose(0, std::sin(half), 0, std::cos(half), {0, 0, 0});
    };
    scene.colliders.push_back(sphere);
    scene.solids.push_back(measure::Capsule{{0, 0, 0}, {0, 0, 0}, radius});
    scene.contact.contact_distance = kHairballDistance;
    scene.duration = 5;
    scene.least_contacts = 3000;
    scene.held_edges = 1;
    std::vector<Double3> roots;
    for (const RodStrand& s : scene.strands) roots.push_back(s.points[0]);
    scene.drive = [roots](RodSimulation& rods, double t, double h) {
        const double angle = hairball_angle(t), turn = angle - hairball_angle(t - h);
        const double c = std::cos(angle), d = std::sin(angle);
        for (std::size_t s = 0; s < roots.size(); ++s) {
            const Double3& p = roots[s];
            (void)rods.move_root(s,
                                 {{c * p[0] + d * p[2], p[1], c * p[2] - d * p[0]}, {0, turn, 0}});
        }
    };
    return scene;
}

}  // namespace keratin::scenes
