#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>
#include <cstdio>

using namespace keratin;
using namespace keratin::test;

TEST_CASE("each strand follows its own bone") {
    scenes::GroomOptions options;
    options.bones = {"left", "right"};
    for (int i = 0; i < 64; ++i) options.bone_of_strand.push_back(std::uint32_t(i % 2));
    const scenes::Groom groom = head(64, 8, 0.1, options);
    Simulation s = made(groom, single_thread());
    const RigidTransform up{{0, 0.3, 0}, {0, 0, 0, 1}};
    for (int i = 1; i <= 60; ++i) {
        const RigidTransform part{{0, 0.3 * i / 60, 0}, {0, 0, 0, 1}};
        must(s.set_bones(std::vector<RigidTransform>{{}, part}));
        must(s.step(1.0 / 60));
    }
    for (std::uint32_t lane : lanes_of(s)) {
        const bool right = groom.guide_strand[lane] % 2 == 1;
        for (std::uint32_t p : {0u, 1u})
            CHECK(distance(point(s, lane, p),
                           carried(right ? up : RigidTransform{}, rest_point(s, lane, p))) < 1e-6);
    }
}

TEST_CASE("up to four bones blend by their weights") {
    scenes::GroomOptions options;
    options.bones = {"a", "b"};
    options.bone_of_strand.assign(16, 0);
    scenes::Groom groom = head(16, 8, 0.1, options);
    for (std::size_t l = 0; l < 16; ++l) {
        groom.guide_bone_weight[l] = 0.25f;
        groom.guide_bone[16 + l] = 1;
        groom.guide_bone_weight[16 + l] = 0.75f;
    }
    Simulation s = made(groom, single_thread());
    must(s.set_bones(std::vector<RigidTransform>{{}, {{0.04, 0, 0}, {0, 0, 0, 1}}}));
    must(s.step(1.0 / 60));
    CHECK(point(s, 3, 0)[0] == Approx(rest_point(s, 3, 0)[0] + 0.03).margin(1e-6));
}

TEST_CASE("roots stay on their triangle as it moves, stretches and turns") {
    scenes::GroomOptions options;
    options.attach = Attach::triangle;
    options.body.vertex = {{0, 0, 0}, {0.02f, 0, 0}, {0, 0, 0.03f}, {0.02f, 0.01f, 0.03f}};
    options.body.triangle = {{0, 2, 1}, {1, 2, 3}};
    const double u = 0.3, v = 0.25;
    const auto on = [&](const std::vector<float>& mesh, int t) {
        Point p{};
        const auto& c = options.body.triangle[std::size_t(t)];
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = (1 - u - v) * double(mesh[c[0] * 3 + k]) + u * double(mesh[c[1] * 3 + k]) +
                   v * double(mesh[c[2] * 3 + k]);
        return p;
    };
    std::vector<float> mesh;
    for (const auto& x : options.body.vertex) mesh.insert(mesh.end(), x.begin(), x.end());
    std::vector<scenes::Line> lines;
    for (int t = 0; t < 2; ++t) {
        const Point root = on(mesh, t);
        lines.push_back(scenes::straight_line(root, {0, 1, 0}, 0.05, 8));
        options.triangle_of_strand.push_back(std::uint32_t(t));
    }
    const scenes::Groom groom = scenes::make_groom(lines, options);
    Settings settings = single_thread();
    settings.gravity = {0, 0, 0};
    Simulation s = made(groom, settings);

    // Turned by a right angle about x, stretched along x and moved, over a second.
    for (int i = 1; i <= 60; ++i) {
        const double f = i / 60.0, a = f * 3.14159265358979 / 2;
        auto now = mesh;
        for (std::size_t k = 0; k < 4; ++k) {
            const double x = double(mesh[k * 3]), y = double(mesh[k * 3 + 1]),
                         z = double(mesh[k * 3 + 2]);
            now[k * 3] = float(x * (1 + 0.5 * f) + 0.1 * f);
            now[k * 3 + 1] = float(y * std::cos(a) - z * std::sin(a));
            now[k * 3 + 2] = float(y * std::sin(a) + z * std::cos(a));
        }
        must(s.set_mesh(now));
        must(s.step(1.0 / 60));
        for (int t = 0; t < 2; ++t) {
            const std::uint32_t lane = lanes_of(s)[std::size_t(t)];
            REQUIRE(distance(point(s, lane, 0), on(now, int(groom.guide_strand[lane]))) <
                    1e-6 * 0.03 + 1e-8);
        }
    }
    // The first triangle lay in the plane y = 0 and now stands in z = 0: its strand points along z.
    const Point a = point(s, 0, 0), b = point(s, 0, 1);
    const double l = distance(a, b);
    CHECK((b[2] - a[2]) / l == Approx(1).margin(1e-4));
    // And the render strand with it.
    const StrandView view = s.strands();
    CHECK(double(view.position[0]) ==
          Approx(on(std::vector<float>(mesh), 0)[0] * 1.5 + 0.1).margin(1e-6));
}

TEST_CASE("a root on a small triangle of a face is where floats can hold it") {
    // 1.2 mm, 0.2 m from the origin; it turns, with its surroundings, by up to half a radian about
    // an axis beside it. Exact is the point between the vertices as given.
    scenes::GroomOptions options;
    options.attach = Attach::triangle;
    options.body.vertex = {{0.03f, -0.12f, 0.15f}, {0.0312f, -0.12f, 0.15f}, {0.03f, -0.1188f, 0.1503f}};
    options.body.triangle = {{0, 1, 2}};
    options.triangle_of_strand = {0};
    const double u = 0.3, v = 0.25;
    const auto on = [&](const std::vector<float>& mesh) {
        Point p{};
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = (1 - u - v) * double(mesh[k]) + u * double(mesh[3 + k]) + v * double(mesh[6 + k]);
        return p;
    };
    std::vector<float> mesh;
    for (const auto& x : options.body.vertex) mesh.insert(mesh.end(), x.begin(), x.end());
    const std::vector<scenes::Line> lines{scenes::straight_line(on(mesh), {0, 0, 1}, 0.02, 6)};
    const scenes::Groom groom = scenes::make_groom(lines, options);
    Simulation s = made(groom, single_thread());
    double worst = 0;
    for (int i = 1; i <= 60; ++i) {
        const double a = 0.5 * i / 60;
        auto now = mesh;
        for (std::size_t k = 0; k < 3; ++k) {
            const double x = double(mesh[k * 3]) - 0.05, z = double(mesh[k * 3 + 2]) - 0.1;
            now[k * 3] = float(0.05 + x * std::cos(a) + z * std::sin(a));
            now[k * 3 + 2] = float(0.1 + z * std::cos(a) - x * std::sin(a));
        }
        must(s.set_mesh(now));
        must(s.step(1.0 / 60));
        worst = std::max(worst, distance(point(s, lanes_of(s)[0], 0), on(now)));
    }
    std::printf("root on a triangle of 1.2 mm: off by %.3g m\n", worst);
    // Floats between 1/8 and 1/4 m are 1.5e-8 apart.
    CHECK(worst < 1.5e-8);
}

TEST_CASE("the asset's motion carries bones and triangles too") {
    scenes::GroomOptions options;
    options.bones = {"a"};
    options.bone_of_strand.assign(16, 0);
    const scenes::Groom groom = head(16, 8, 0.1, options);
    Simulation s = made(groom, single_thread());
    const RigidTransform body{{0.1, 0, 0}, {0, 0.1, 0, std::sqrt(0.99)}},
        bone{{0, 0.02, 0}, {0, 0, 0, 1}};
    must(s.set_motion(body));
    must(s.set_bones({&bone, 1}));
    must(s.step(1.0 / 60));
    const Point expected = carried(body, carried(bone, rest_point(s, 2, 0)));
    CHECK(distance(point(s, 2, 0), expected) < 1e-6);
}

TEST_CASE("hair that is only carried follows rigidly") {
    scenes::GroomOptions options;
    options.attach = Attach::all;
    const scenes::Groom groom = head(64, 8, 0.1, options);
    Simulation s = made(groom, single_thread());
    must(s.set_motion(shaken(0.1)));
    must(s.step(1.0 / 60));
    const StrandView v = s.strands();
    for (std::size_t i = 0; i < groom.info.point_count; ++i) {
        const Point rest{double(groom.strand_position[i * 3]),
                         double(groom.strand_position[i * 3 + 1]),
                         double(groom.strand_position[i * 3 + 2])};
        const Point now{double(v.position[i * 3]), double(v.position[i * 3 + 1]),
                        double(v.position[i * 3 + 2])};
        REQUIRE(distance(now, carried(shaken(0.1), rest)) < 1e-6);
    }
}

TEST_CASE("render strands of another number of points follow their guides by arc length") {
    for (bool fractions : {false, true}) {
        // Two guides of 8 points and one render strand of 15 between them, all straight.
        std::vector<scenes::Line> lines{scenes::straight_line({0, 0, 0}, {0, 1, 0}, 0.14, 8),
                                        scenes::straight_line({0.005, 0, 0}, {0, 1, 0}, 0.14, 15),
                                        scenes::straight_line({0.01, 0, 0}, {0, 1, 0}, 0.14, 8)};
        scenes::GroomOptions options;
        options.guide_every = 2;
        options.fractions = fractions;
        options.group.material.radius = options.group.material.radius2 = 1e-5f;
        const scenes::Groom groom = scenes::make_groom(lines, options);
        Simulation s = made(groom, single_thread());
        must(s.set_gravity({0, 0, 5}));
        run(s, 0.1, 1.0 / 60);
        const StrandView v = s.strands();
        // Even points of the render strand stand at the guides' points, halfway between both.
        for (std::uint32_t p = 0; p < 8; ++p) {
            const Point a = point(s, 0, p), b = point(s, 1, p);
            const std::size_t at = (groom.strand_first_point[1] + 2 * p) * 3;
            for (std::size_t c = 0; c < 3; ++c)
                CHECK(double(v.position[at + c]) == Approx(0.5 * (a[c] + b[c])).margin(2e-5));
        }
        CHECK(point(s, 0, 7)[2] > 0.005);
    }
}
