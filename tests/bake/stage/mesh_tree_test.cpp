#include "bake/stage/mesh_tree.h"

#include "bake/read/read_curves.h"
#include "bake/read/read_mesh.h"
#include "tests/bake/stage/shapes.h"
#include "tests/data_dir.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <random>

using namespace keratin;

namespace {

// Distance of a point from a triangle by another way than the bake's: the foot on the plane when it
// lies inside, else the nearest of the edges.
double plain_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto to_edge = [&](const Vec3& u, const Vec3& v) {
        const Vec3 e = v - u;
        const double ee = e.dot(e);
        double t = ee > 0 ? (p - u).dot(e) / ee : 0;
        t = t < 0 ? 0 : t > 1 ? 1 : t;
        return (p - u - t * e).norm();
    };
    const Vec3 n = (b - a).cross(c - a);
    const double nn = n.dot(n);
    if (nn > 0) {
        const bool inside = n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
                            n.dot((a - c).cross(p - c)) >= 0;
        if (inside) return std::abs(n.dot(p - a)) / std::sqrt(nn);
    }
    return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

struct Wrong {
    std::size_t roots = 0, not_nearest = 0, not_lowest = 0;
};

// Compares nearest() for some roots with every triangle, one after another.
Wrong compare_with_all(const RawMesh& mesh, std::span<const std::uint32_t> triangles,
                       std::span<const Vec3> roots) {
    const MeshTree tree(mesh, triangles);
    std::vector<Eigen::AlignedBox3d> boxes;
    for (std::uint32_t t : triangles) {
        Eigen::AlignedBox3d box;
        for (std::uint32_t v : mesh.triangle[t]) box.extend(mesh.position[v]);
        boxes.push_back(box);
    }
    Wrong wrong;
    wrong.roots = roots.size();
    const double tie = tree.tie_tolerance();
    for (const Vec3& root : roots) {
        const NearestTriangle found = tree.nearest(root);
        double least = found.at.distance;
        std::uint32_t lowest = found.triangle;
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            // Too far for certain: the box holds the triangle.
            if (boxes[i].exteriorDistance(root) > least + 2 * tie) continue;
            const auto& c = mesh.triangle[triangles[i]];
            const double d =
                plain_distance(root, mesh.position[c[0]], mesh.position[c[1]], mesh.position[c[2]]);
            if (d < least - tie) least = d;
            if (d <= found.at.distance + tie / 2 && triangles[i] < lowest) lowest = triangles[i];
        }
        wrong.not_nearest += least < found.at.distance - tie;
        wrong.not_lowest += lowest != found.triangle;
    }
    return wrong;
}

std::vector<Vec3> roots_of(const std::string& file) {
    const auto groom = read_curves(std::string(KERATIN_DATA_DIR) + "/tressfx/" + file);
    if (!groom) FAIL(to_string(groom.error()));
    std::vector<Vec3> out;
    for (const RawCurve& curve : groom->curves) out.push_back(curve.points.front());
    return out;
}

RawMesh mesh_of(const std::string& file) {
    auto mesh = read_mesh(std::string(KERATIN_DATA_DIR) + "/tressfx/" + file);
    if (!mesh) FAIL(to_string(mesh.error()));
    return *std::move(mesh);
}

}  // namespace

TEST_CASE("every root of the ponytail head finds its nearest triangle, the lowest of equals") {
    const RawMesh mesh = mesh_of("ponytail.obj");
    const std::vector<std::string> head{"Mesh_head"}, bands{"Mesh_hairBands_*"};
    for (const char* file : {"front_top.tfx", "side.tfx", "back.tfx", "tail.tfx"}) {
        INFO(file);
        const bool tail = std::string(file) == "tail.tfx";
        const auto triangles = triangles_of_parts(mesh, tail ? bands : head);
        const std::vector<Vec3> roots = roots_of(file);
        const Wrong wrong = compare_with_all(mesh, triangles, roots);
        CHECK(wrong.roots > 200);
        CHECK(wrong.not_nearest == 0);
        CHECK(wrong.not_lowest == 0);
    }
}

TEST_CASE("a thousand roots of the bear find their nearest triangle, the lowest of equals") {
    const RawMesh mesh = mesh_of("bear.obj");
    const std::vector<Vec3> all = roots_of("bear.tfx");
    std::vector<Vec3> roots;
    for (std::size_t i = 0; i < 1000; ++i) roots.push_back(all[i * all.size() / 1000]);
    const Wrong wrong = compare_with_all(mesh, triangles_of_parts(mesh, {}), roots);
    CHECK(wrong.roots == 1000);
    CHECK(wrong.not_nearest == 0);
    CHECK(wrong.not_lowest == 0);
}

TEST_CASE("a point above a shared edge or vertex goes to the lowest triangle number") {
    const RawMesh mesh = test::plane_mesh(1, 4);
    const MeshTree tree(mesh, triangles_of_parts(mesh, {}));
    for (std::size_t v = 0; v < mesh.position.size(); ++v) {
        std::uint32_t lowest = ~0u;
        for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
            for (std::uint32_t c : mesh.triangle[t]) {
                if (c == v) lowest = std::min(lowest, t);
            }
        }
        CHECK(tree.nearest(mesh.position[v] + Vec3(0, 0.3, 0)).triangle == lowest);
        CHECK(tree.nearest(mesh.position[v]).triangle == lowest);
    }
}

TEST_CASE("the nearest point is where its barycentrics say") {
    const RawMesh mesh = test::sphere_mesh({1, 2, 3}, 0.5, 12);
    const MeshTree tree(mesh, triangles_of_parts(mesh, {}));
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 200; ++i) {
        const Vec3 p = Vec3(1, 2, 3) + Vec3(uniform(random), uniform(random), uniform(random));
        const NearestTriangle near = tree.nearest(p);
        const auto& c = mesh.triangle[near.triangle];
        const auto& w = near.at.barycentric;
        const Vec3 q =
            w[0] * mesh.position[c[0]] + w[1] * mesh.position[c[1]] + w[2] * mesh.position[c[2]];
        CHECK((q - near.at.point).norm() < 1e-12);
        CHECK((p - q).norm() == Approx(near.at.distance));
        CHECK(w[0] + w[1] + w[2] == Approx(1));
        CHECK(std::min({w[0], w[1], w[2]}) >= -1e-12);
    }
}

TEST_CASE("signed distance to a sphere is the distance to its centre less the radius") {
    const RawMesh mesh = test::sphere_mesh({0, 0, 0}, 0.1, 60);
    const MeshTree tree(mesh, triangles_of_parts(mesh, {}));
    std::mt19937 random(2);
    std::uniform_real_distribution<double> uniform(-0.15, 0.15);
    // Sagitta of the facets: r (1 - cos(pi / 60)).
    const double facet = 0.1 * (1 - std::cos(std::numbers::pi / 60));
    for (int i = 0; i < 500; ++i) {
        const Vec3 p(uniform(random), uniform(random), uniform(random));
        const double exact = p.norm() - 0.1;
        CHECK(std::abs(tree.signed_distance(p) - exact) < 1.5 * facet);
    }
}

TEST_CASE("over the hole of a bowl the signed distance is that to the disc which closes it") {
    // Half a sphere sees half of all directions from anywhere on the disc. To first order the
    // distance on the axis is |y| (1 + y^2 / r^2).
    const RawMesh mesh = test::sphere_mesh({0, 0, 0}, 0.1, 60);
    std::vector<std::uint32_t> bowl;
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
        const auto& c = mesh.triangle[t];
        if (std::all_of(c.begin(), c.end(), [&](auto v) { return mesh.position[v].y() < 1e-9; }))
            bowl.push_back(t);
    }
    REQUIRE(bowl.size() == mesh.triangle.size() / 2);
    const MeshTree tree(mesh, bowl);
    for (double y = -0.03; y < 0.03; y += 0.001) {
        const double first_order = y * (1 + y * y / 0.01);
        INFO(y);
        // Far clusters of triangles count as dipoles: some percent of the distance.
        CHECK(std::abs(tree.signed_distance({0, y, 0}) - first_order) < 1e-4 + 0.08 * std::abs(y));
    }
    // At the rim the two meet.
    CHECK(std::abs(tree.signed_distance({0.0999, 0.0001, 0})) < 2e-4);
}

TEST_CASE("inside agrees with the sum of all solid angles on an open head") {
    const RawMesh mesh = mesh_of("ponytail.obj");
    const std::vector<std::string> head{"Mesh_head"};
    const auto triangles = triangles_of_parts(mesh, head);
    const MeshTree tree(mesh, triangles);
    Eigen::AlignedBox3d box;
    for (std::uint32_t t : triangles) {
        for (std::uint32_t v : mesh.triangle[t]) box.extend(mesh.position[v]);
    }
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::size_t inside = 0, differ = 0, near_half = 0;
    for (int i = 0; i < 400; ++i) {
        const Vec3 share(uniform(random), uniform(random), uniform(random));
        const Vec3 p = box.min() + share.cwiseProduct(box.sizes());
        double sum = 0;
        for (std::uint32_t t : triangles) {
            const Vec3 a = mesh.position[mesh.triangle[t][0]] - p;
            const Vec3 b = mesh.position[mesh.triangle[t][1]] - p;
            const Vec3 c = mesh.position[mesh.triangle[t][2]] - p;
            const double la = a.norm(), lb = b.norm(), lc = c.norm();
            sum += 2 * std::atan2(a.dot(b.cross(c)),
                                  la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        }
        const double winding = sum / (4 * std::numbers::pi);
        inside += winding > 0.5;
        // In the plane of the open neck the number passes through a half.
        if (std::abs(winding - 0.5) < 0.05) {
            ++near_half;
        } else {
            differ += tree.inside(p) != (winding > 0.5);
        }
    }
    CHECK(inside > 50);
    CHECK(near_half < 40);
    CHECK(differ == 0);
}

TEST_CASE("parts are named with stars") {
    CHECK(matches("Mesh_hairBands_pTorus1", "Mesh_hairBands_*"));
    CHECK(matches("Mesh_head", "*head"));
    CHECK(matches("Mesh_head", "M*h*d"));
    CHECK(matches("", "*"));
    CHECK_FALSE(matches("Mesh_head2", "Mesh_head"));
    CHECK_FALSE(matches("Mesh_head", "mesh_head"));
    CHECK_FALSE(matches(std::string(5000, 'a'), "*a*a*a*a*a*a*a*a*b"));
}
