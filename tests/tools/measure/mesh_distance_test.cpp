#include "tools/measure/mesh_distance.h"

#include "tests/data_dir.h"
#include "tools/measure/penetration.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

using namespace keratin::measure;

namespace {

struct Mesh {
    std::vector<Point> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

// The unit sphere in rings from pole to pole; the rings below `open` (0..1 of the way) are left
// out, which leaves a hole.
Mesh sphere(std::uint32_t rings, double open) {
    Mesh mesh;
    const std::uint32_t around = 2 * rings;
    for (std::uint32_t r = 0; r <= rings; ++r)
        for (std::uint32_t s = 0; s < around; ++s) {
            const double a = std::numbers::pi * r / rings, b = 2 * std::numbers::pi * s / around;
            mesh.vertices.push_back(
                {std::sin(a) * std::cos(b), std::cos(a), -std::sin(a) * std::sin(b)});
        }
    for (std::uint32_t r = 0; r < rings; ++r)
        for (std::uint32_t s = 0; s < around; ++s) {
            if (r >= open * rings) continue;
            const std::uint32_t a = r * around + s, b = r * around + (s + 1) % around;
            mesh.triangles.push_back({a, a + around, b});
            mesh.triangles.push_back({b, a + around, b + around});
        }
    return mesh;
}

std::vector<Point> random_points(std::size_t count, Point low, Point high) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Point> out;
    for (std::size_t i = 0; i < count; ++i) {
        const double a = unit(random), b = unit(random), c = unit(random);
        out.push_back({low.x + a * (high.x - low.x), low.y + b * (high.y - low.y),
                       low.z + c * (high.z - low.z)});
    }
    return out;
}

double exact_winding(const Mesh& mesh, Point x) {
    double sum = 0;
    for (const auto& t : mesh.triangles)
        sum +=
            winding_of_triangle(x, {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
    return sum;
}

double exact_distance(const Mesh& mesh, Point x) {
    double best = 1e300;
    for (const auto& t : mesh.triangles)
        best = std::min(
            best, distance(x, nearest_on_triangle(x, {mesh.vertices[t[0]], mesh.vertices[t[1]],
                                                      mesh.vertices[t[2]]})));
    return best;
}

// Triangles of an OBJ file; only v and f lines matter here.
Mesh read_obj(const std::string& path) {
    Mesh mesh;
    std::ifstream in(path);
    std::string line, word;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        words >> word;
        if (word == "v") {
            Point p;
            words >> p.x >> p.y >> p.z;
            mesh.vertices.push_back(p);
        } else if (word == "f") {
            std::vector<std::uint32_t> face;
            while (words >> word) face.push_back(static_cast<std::uint32_t>(std::stoul(word)) - 1);
            for (std::size_t i = 2; i < face.size(); ++i)
                mesh.triangles.push_back({face[0], face[i - 1], face[i]});
        }
    }
    return mesh;
}

}  // namespace

TEST_CASE("the signed distance to a fine sphere is that to the ball") {
    const Mesh mesh = sphere(60, 1);
    const MeshDistance ball(mesh.vertices, mesh.triangles);
    double worst = 0;
    for (const Point& x : random_points(2000, {-2, -2, -2}, {2, 2, 2}))
        worst = std::max(worst, std::abs(ball.signed_distance(x) - (length(x) - 1)));
    CHECK(worst < 2e-3);  // sagitta of the facets, (pi / 60)^2 / 2
}

TEST_CASE("a mesh that faces inwards has the same inside") {
    Mesh mesh = sphere(20, 1);
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    const MeshDistance ball(mesh.vertices, mesh.triangles);
    CHECK(ball.signed_distance({0, 0, 0}) < -0.9);
    CHECK(ball.signed_distance({0, 0, 1.5}) > 0.4);
}

TEST_CASE(
    "a sphere with a hole still has an inside, and what is near the hole outside is outside") {
    const Mesh mesh = sphere(40, 0.85);
    const MeshDistance bowl(mesh.vertices, mesh.triangles);
    CHECK(bowl.signed_distance({0, 0.5, 0}) < 0);
    CHECK(bowl.signed_distance({0.9, 0, 0}) < 0);
    CHECK(bowl.signed_distance({0, -0.5, 0}) < 0);
    CHECK(bowl.signed_distance({0, -1.2, 0}) > 0);
    CHECK(bowl.signed_distance({1.1, 0, 0}) > 0);
}

TEST_CASE("the tree finds the distance and the winding number that all triangles give") {
    const Mesh mesh = sphere(16, 0.8);
    const MeshDistance tree(mesh.vertices, mesh.triangles);
    double worst_distance = 0, worst_winding = 0;
    for (const Point& x : random_points(500, {-3, -3, -3}, {3, 3, 3})) {
        worst_distance =
            std::max(worst_distance, std::abs(tree.unsigned_distance(x) - exact_distance(mesh, x)));
        worst_winding =
            std::max(worst_winding, std::abs(tree.winding_number(x) - exact_winding(mesh, x)));
    }
    CHECK(worst_distance < 1e-14);
    CHECK(worst_winding < 0.02);
}

TEST_CASE("the open head of the ponytail has an inside, found as by all its triangles") {
    const Mesh mesh = read_obj(KERATIN_DATA_DIR "/tressfx/ponytail.obj");
    REQUIRE(mesh.triangles.size() > 1000);
    const MeshDistance tree(mesh.vertices, mesh.triangles);
    Point low = mesh.vertices[0], high = low;
    for (const Point& p : mesh.vertices) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    double worst = 0;
    std::size_t inside = 0;
    const double facing =
        tree.winding_number((low + high) * 0.5) * exact_winding(mesh, (low + high) * 0.5) < 0 ? -1
                                                                                              : 1;
    const auto points = random_points(150, low, high);
    for (const Point& x : points) {
        worst = std::max(worst, std::abs(tree.winding_number(x) - facing * exact_winding(mesh, x)));
        inside += tree.signed_distance(x) < 0;
    }
    std::printf(
        "ponytail head: winding number within %.2g of the exact sum; %zu of %zu points of "
        "its box are inside\n",
        worst, inside, points.size());
    CHECK(worst < 0.05);
    CHECK(inside > points.size() / 4);
    CHECK(inside < points.size());
}

TEST_CASE("penetration counts only what is deeper than the groom at rest") {
    const Mesh mesh = sphere(40, 1);
    const MeshDistance ball(mesh.vertices, mesh.triangles);
    const std::vector<Point> rest{{0, 0, 0.9}, {0, 0, 1.5}, {0, 0, 3}};
    PenetrationTracker tracker(ball, rest);
    CHECK(tracker.rest_depth()[0] == Approx(0.1).margin(2e-3));
    CHECK(tracker.rest_depth()[1] == 0);
    CHECK(tracker.measure(rest).deeper == 0);
    std::vector<Point> now = rest;
    now[0].z = 0.95;
    now[1].z = 1.1;
    CHECK(tracker.measure(now).deeper == 0);
    now[0].z = 0.85;
    CHECK(tracker.measure(now).deeper == Approx(0.05).margin(2e-3));
    now[1].z = 0.8;
    const auto worst = tracker.measure(now);
    CHECK(worst.deeper == Approx(0.2).margin(4e-3));
    CHECK(worst.point == 1);
    // Small steps add up: a point that creeps in is noticed.
    now = rest;
    double deepest = 0;
    for (; now[2].z > 0.9; now[2].z -= 0.01)
        deepest = std::max(deepest, tracker.measure(now).deeper);
    CHECK(deepest == Approx(0.095).margin(0.01));
}

TEST_CASE("a mesh without triangles is nowhere near") {
    const MeshDistance nothing({}, {});
    CHECK(nothing.signed_distance({0, 0, 0}) > 1e300);
}
