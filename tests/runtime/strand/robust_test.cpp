#include "tests/runtime/strand/allocations.h"
#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>

#include <limits>

using namespace keratin;
using namespace keratin::test;

namespace {

// A flat sheet of triangles in the plane y = 0, one strand on each.
struct Sheet {
    scenes::GroomOptions options;
    std::vector<scenes::Line> lines;
    std::vector<float> vertices;
};

Sheet sheet(std::uint32_t n) {
    Sheet s;
    s.options.attach = Attach::triangle;
    for (std::uint32_t i = 0; i < n; ++i) {
        const float x = 0.02f * float(i);
        const auto first = std::uint32_t(s.options.body.vertex.size());
        s.options.body.vertex.push_back({x, 0, 0});
        s.options.body.vertex.push_back({x, 0, 0.02f});
        s.options.body.vertex.push_back({x + 0.02f, 0, 0});
        s.options.body.triangle.push_back({first, first + 1, first + 2});
        s.options.triangle_of_strand.push_back(i);
        s.lines.push_back(scenes::straight_line({double(x) + 0.006, 0, 0.006}, {0, 1, 0}, 0.1, 8));
    }
    for (const auto& v : s.options.body.vertex)
        s.vertices.insert(s.vertices.end(), v.begin(), v.end());
    return s;
}

}  // namespace

TEST_CASE("a step allocates nothing") {
    scenes::GroomOptions options;
    options.guide_every = 2;
    options.group.strand.friction = {0.1f};
    options.group.strand.volume = {0.2f};
    const scenes::Groom groom = head(128, 12, 0.2, options);
    Settings settings = single_thread();
    settings.wind = {{1, 0, 0}, 0.5f, 0.5f};
    settings.colliders.push_back({SphereCollider{{0, 0, 0}, 0.09f}});
    Simulation s = made(groom, settings);
    const long before = allocation_count();
    for (int i = 1; i <= 20; ++i) {
        must(s.set_motion(shaken(i / 60.0)));
        must(s.set_collider(0, shaken(i / 60.0)));
        must(s.step(1.0 / 60));
    }
    CHECK(allocation_count() - before == 0);
}

TEST_CASE("a strand that is no number is reset, and the others do not notice") {
    const scenes::Groom groom = head(100, 12, 0.2);
    Simulation healthy = made(groom, single_thread()), ill = made(groom, single_thread());
    run(healthy, 0.2, 1.0 / 60);
    run(ill, 0.2, 1.0 / 60);
    // The state is the simulation's own memory: spoil one number of one strand.
    const std::uint32_t lane = 37;
    const std::size_t row = groom.tile_first_row[lane / 16] + 6;
    const_cast<float&>(ill.guides().position[vector_index(row, 3, 1, lane % 16)]) =
        std::numeric_limits<float>::quiet_NaN();
    run(healthy, 0.2, 1.0 / 60);
    run(ill, 0.2, 1.0 / 60);
    CHECK(ill.health().strands_reset == 1);
    CHECK(healthy.health().strands_reset == 0);
    for (std::uint32_t other : lanes_of(ill))
        for (std::uint32_t p = 0; p < 12; ++p) {
            if (other == lane) {
                for (double c : point(ill, other, p)) REQUIRE(std::isfinite(c));
            } else {
                REQUIRE(point(ill, other, p) == point(healthy, other, p));
            }
        }
}

TEST_CASE("with friction a spoiled strand does not reach the others through the grid") {
    scenes::GroomOptions options;
    options.group.strand.friction = {0.3f};
    const scenes::Groom groom = head(100, 12, 0.2, options);
    Simulation s = made(groom, single_thread());
    run(s, 0.1, 1.0 / 60);
    const_cast<float&>(s.guides().position[vector_index(5, 3, 1, 3)]) =
        std::numeric_limits<float>::infinity();
    run(s, 0.1, 1.0 / 60);
    CHECK(s.health().strands_reset == 1);
    for (std::uint32_t lane : lanes_of(s))
        for (double c : tip(s, lane)) REQUIRE(std::isfinite(c));
}

TEST_CASE("a root that is no number keeps its last place and is counted") {
    const Sheet sh = sheet(5);
    const scenes::Groom groom = scenes::make_groom(sh.lines, sh.options);
    Simulation s = made(groom, single_thread()), well = made(groom, single_thread());
    auto vertices = sh.vertices;
    vertices[2 * 9 + 4] = std::numeric_limits<float>::quiet_NaN();
    must(s.set_mesh(vertices));
    run(s, 0.1, 1.0 / 60);
    run(well, 0.1, 1.0 / 60);
    CHECK(s.health().roots_refused == 6);
    CHECK(s.position_hash() == well.position_hash());
}

TEST_CASE("a jump of the root carries the strand rigidly and keeps its shape") {
    const scenes::Groom groom = head(64, 12, 0.2);
    Simulation s = made(groom, single_thread()), stay = made(groom, single_thread());
    run(s, 0.5, 1.0 / 60);
    run(stay, 0.5, 1.0 / 60);
    // 10 m away and turned by half a turn, in one frame.
    must(s.set_motion({{10, 0, 0}, {0, 1, 0, 0}}));
    must(s.step(1.0 / 60));
    must(stay.step(1.0 / 60));
    CHECK(s.health().strands_teleported == 64);
    for (std::uint32_t lane : lanes_of(s))
        for (std::uint32_t p = 0; p < 12; ++p) {
            const Point there = carried({{10, 0, 0}, {0, 1, 0, 0}}, point(stay, lane, p));
            REQUIRE(distance(point(s, lane, p), there) < 2e-4);
        }
    // Motion below the threshold is motion.
    Simulation moved = made(groom, single_thread());
    must(moved.set_motion({{0.1, 0, 0}, {0, 0, 0, 1}}));
    must(moved.step(1.0 / 60));
    CHECK(moved.health().strands_teleported == 0);
}

TEST_CASE("teleport drops or turns the velocity as asked") {
    const scenes::Groom groom = head(64, 12, 0.2);
    for (Velocity velocity : {Velocity::keep, Velocity::zero}) {
        Simulation s = made(groom, single_thread());
        run(s, 0.1, 1.0 / 60);
        const double before = speed(s, 5, 11);
        REQUIRE(before > 0.1);
        must(s.set_motion({{1, 2, 3}, {0, 0, 1, 0}}));
        s.teleport(velocity);
        CHECK(speed(s, 5, 11) == Approx(velocity == Velocity::keep ? before : 0).margin(1e-3));
        CHECK(s.time() == Approx(0.1));
    }
}

TEST_CASE("a million metres from the origin nothing changes when the origin goes along") {
    const scenes::Groom groom = head(64, 12, 0.2);
    const double far = 1048576;
    Settings settings = single_thread();
    Simulation near = made(groom, settings);
    settings.origin = {far, 0, -far};
    Simulation away = made(groom, settings);
    for (int i = 1; i <= 30; ++i) {
        RigidTransform t = shaken(i / 60.0);
        if (i == 1) {
            must(near.set_motion({}));
            near.reset();
            must(away.set_motion({{far, 0, -far}, {0, 0, 0, 1}}));
            away.reset();
        }
        must(near.set_motion(t));
        t.translation[0] += far;
        t.translation[2] -= far;
        must(away.set_motion(t));
        must(near.step(1.0 / 60));
        must(away.step(1.0 / 60));
    }
    // The motion itself is known to 1e-10 m out there.
    for (std::uint32_t lane : lanes_of(near))
        REQUIRE(distance(tip(near, lane), tip(away, lane)) < 1e-4);
}

TEST_CASE("moving the origin moves what is handed out, not the hair") {
    const scenes::Groom groom = head(64, 12, 0.2);
    Simulation s = made(groom, single_thread());
    run(s, 0.3, 1.0 / 60);
    const Point before = tip(s, 4);
    s.set_origin({2, 0, 1});
    const Point after = tip(s, 4);
    CHECK(after[0] + 2 == Approx(before[0]).margin(1e-6));
    CHECK(after[2] + 1 == Approx(before[2]).margin(1e-6));
    Simulation other = made(groom, single_thread());
    run(other, 0.6, 1.0 / 60);
    run(s, 0.3, 1.0 / 60);
    CHECK(s.health().strands_teleported == 0);
    const Point a = tip(s, 4), b = tip(other, 4);
    CHECK(distance({a[0] + 2, a[1], a[2] + 1}, b) < 1e-3);
}

TEST_CASE("a saved state goes on bit for bit") {
    scenes::GroomOptions options;
    options.guide_every = 2;
    options.group.strand.friction = {0.1f};
    const scenes::Groom groom = head(128, 12, 0.2, options);
    Settings settings = single_thread();
    settings.wind = {{1, 0, 0}, 0.5f, 0.5f};
    Simulation first = made(groom, settings);
    const auto go = [](Simulation& s, int from, int to) {
        for (int i = from; i < to; ++i) {
            must(s.set_motion(shaken(i / 60.0)));
            must(s.step(1.0 / 60));
        }
    };
    go(first, 0, 25);
    const auto state = first.save();
    go(first, 25, 50);
    Simulation second = made(groom, settings);
    must(second.load(state));
    go(second, 25, 50);
    CHECK(second.position_hash() == first.position_hash());

    CHECK_FALSE(second.load(std::span(state).first(100)));
    Settings other = settings;
    other.iterations = 7;
    Simulation third = made(groom, other);
    CHECK_FALSE(third.load(state));
}

TEST_CASE("hair at rest falls asleep and wakes with its root, a collider or its neighbours") {
    scenes::GroomOptions options;
    options.group.strand.damping = {0.5f};
    const scenes::Groom groom = head(64, 8, 0.05, options);
    Settings settings = single_thread();
    settings.sleep_speed = 0.002f;
    settings.colliders.push_back({SphereCollider{{0, 0.3f, 0}, 0.05f}});
    Simulation s = made(groom, settings);
    for (int i = 0; i < 600 && s.health().strands_asleep < 64; ++i) must(s.step(1.0 / 60));
    REQUIRE(s.health().strands_asleep == 64);
    const auto asleep = s.position_hash();
    run(s, 0.5, 1.0 / 60);
    CHECK(s.position_hash() == asleep);

    must(s.set_collider(0, {{0, -0.17, 0}, {0, 0, 0, 1}}));
    must(s.step(1.0 / 60));
    CHECK(s.health().strands_asleep == 0);
    CHECK(s.position_hash() != asleep);
    must(s.set_collider(0, {}));
    // Hair that the collider threw about at the crown takes ten seconds to unfold.
    for (int i = 0; i < 1200 && s.health().strands_asleep < 64; ++i) must(s.step(1.0 / 60));
    REQUIRE(s.health().strands_asleep == 64);
    must(s.set_motion({{0.01, 0, 0}, {0, 0, 0, 1}}));
    must(s.step(1.0 / 60));
    CHECK(s.health().strands_asleep == 0);
    for (int i = 0; i < 600 && s.health().strands_asleep < 64; ++i) must(s.step(1.0 / 60));
    must(s.set_gravity({3, -9, 0}));
    must(s.step(1.0 / 60));
    CHECK(s.health().strands_asleep == 0);
}

TEST_CASE("the level of detail is a prefix and what remains does not move") {
    scenes::GroomOptions options;
    options.guide_every = 4;
    const scenes::Groom groom = head(128, 12, 0.2, options);
    Simulation full = made(groom, single_thread()), less = made(groom, single_thread());
    run(full, 0.2, 1.0 / 60);
    must(less.set_lod(0.25f));
    run(less, 0.2, 1.0 / 60);
    CHECK(less.strands().strand_count == 32);
    CHECK(less.strands().width_scale == Approx(4));
    for (std::size_t i = 0; i < 32 * 12 * 3; ++i)
        REQUIRE(less.strands().position[i] == full.strands().position[i]);
    CHECK_FALSE(less.set_lod(1.5f));
    must(less.set_lod(1));
    CHECK(less.strands().strand_count == 128);
}

TEST_CASE("half output is the float output rounded") {
    scenes::GroomOptions options;
    options.guide_every = 2;
    const scenes::Groom groom = head(128, 12, 0.2, options);
    Settings settings = single_thread();
    Simulation whole = made(groom, settings);
    settings.output = OutputPrecision::float16;
    Simulation half = made(groom, settings);
    run(whole, 0.2, 1.0 / 60);
    run(half, 0.2, 1.0 / 60);
    const StrandView a = whole.strands(), b = half.strands();
    REQUIRE(b.position_half.size() == a.position.size());
    const auto value = [](std::uint16_t h) {
        const int e = h >> 10 & 31;
        const double m = h & 1023, sign = h & 0x8000 ? -1 : 1;
        return sign * (e == 0 ? std::ldexp(m, -24) : std::ldexp(1024 + m, e - 25));
    };
    for (std::size_t i = 0; i < a.position.size(); ++i) {
        const double exact = double(a.position[i]) - double(b.half_center[i % 3]);
        REQUIRE(std::fabs(value(b.position_half[i]) - exact) <= std::fabs(exact) / 2048 + 1e-7);
    }
}

TEST_CASE("tangents are unit and point along the strand") {
    const scenes::Groom groom = head(32, 12, 0.2);
    Settings settings = single_thread();
    settings.tangents = true;
    Simulation s = made(groom, settings);
    const StrandView v = s.strands();
    for (std::uint32_t p = 0; p < groom.info.point_count; ++p) {
        const auto t = v.tangent.subspan(p * 3, 3);
        CHECK(std::hypot(t[0], t[1], t[2]) == Approx(1).margin(1e-5));
    }
    const auto x = v.position;
    CHECK(v.tangent[0] * (x[3] - x[0]) + v.tangent[1] * (x[4] - x[1]) +
              v.tangent[2] * (x[5] - x[2]) >
          0);
}

TEST_CASE("steps and inputs that cannot be are refused and change nothing") {
    const scenes::Groom groom = head(32, 8, 0.1);
    Simulation s = made(groom, single_thread());
    const auto before = s.position_hash();
    CHECK_FALSE(s.step(0));
    CHECK_FALSE(s.step(-1));
    CHECK_FALSE(s.step(NAN));
    CHECK_FALSE(s.step(10));
    CHECK_FALSE(s.set_motion({{NAN, 0, 0}, {0, 0, 0, 1}}));
    CHECK_FALSE(s.set_motion({{0, 0, 0}, {0, 0, 0, 0}}));
    CHECK_FALSE(s.set_bones(std::vector<RigidTransform>(3)));
    CHECK_FALSE(s.set_mesh(std::vector<float>(7)));
    CHECK_FALSE(s.set_collider(0, {}));
    CHECK_FALSE(s.set_gravity({0, NAN, 0}));
    CHECK(s.position_hash() == before);
}

TEST_CASE("extreme materials, steps and shakes stay finite and inextensible") {
    struct Case {
        const char* name;
        float e, radius;
        double h, amplitude, rate;
    };
    for (const Case& c : {Case{"E 1e-6", 2e3f, 4e-5f, 1.0 / 60, 0.1, 1},
                          Case{"E 1e6", 2e15f, 4e-5f, 1.0 / 60, 0.1, 1},
                          Case{"radius 1 um", 2e9f, 1e-6f, 1.0 / 60, 0.1, 1},
                          Case{"radius 2 mm", 2e9f, 2e-3f, 1.0 / 60, 0.1, 1},
                          Case{"step 0.1 s", 2e9f, 4e-5f, 0.1, 0.1, 1},
                          Case{"step 1e-5 s", 2e9f, 4e-5f, 1e-5, 0.1, 1},
                          Case{"12 Hz shake", 2e9f, 4e-5f, 1.0 / 60, 0.05, 12}}) {
        scenes::GroomOptions options;
        options.group.material.youngs_modulus = c.e;
        options.group.material.radius = options.group.material.radius2 = c.radius;
        const scenes::Groom groom = head(64, 32, 0.15, options);
        Simulation s = made(groom, single_thread());
        const int steps = c.h < 1e-4 ? 200 : int(2 / c.h);
        double worst = 0;
        for (int i = 1; i <= steps; ++i) {
            const double x = c.amplitude * std::sin(6.283185307 * c.rate * i * c.h);
            must(s.set_motion({{x, 0, 0}, {0, 0, 0, 1}}));
            must(s.step(c.h));
            worst = std::max(worst, stretch(s));
        }
        INFO(c.name << ": stretch " << worst);
        CHECK(s.health().strands_reset == 0);
        CHECK(worst < 0.01);
    }
}

TEST_CASE("a strand that starts folded back on itself unfolds and comes to rest") {
    const scenes::Line line = scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.15, 32);
    scenes::GroomOptions options;
    options.group.material.radius = options.group.material.radius2 = 5e-5f;
    options.group.material.youngs_modulus = 3e9f;
    scenes::Groom groom = scenes::make_groom({&line, 1}, options);
    for (std::uint32_t p = 17; p < 32; ++p)
        groom.guide_position[vector_index(groom.tile_first_row[0] + p, 3, 0, 0)] =
            float(line[32 - p][0]);
    Simulation s = made(groom, single_thread());
    run(s, 8, 1.0 / 60);
    double fastest = 0;
    for (std::uint32_t p = 2; p < 32; ++p) fastest = std::max(fastest, speed(s, 0, p));
    INFO(fastest << " m/s");
    CHECK(fastest < 0.001);
    CHECK(distance(tip(s, 0), point(s, 0, 16)) > 0.07);
}

TEST_CASE("folded strands come to rest, whatever their stiffness, length and fold") {
    int at_rest = 0;
    for (const float young : {1e9f, 3e9f, 6e9f})
        for (const double length : {0.1, 0.15, 0.2})
            for (std::uint32_t fold = 8; fold <= 20; fold += 4) {
                const scenes::Line line = scenes::straight_line({0, 0, 0}, {1, 0, 0}, length, 32);
                scenes::GroomOptions options;
                options.group.material.radius = options.group.material.radius2 = 5e-5f;
                options.group.material.youngs_modulus = young;
                scenes::Groom groom = scenes::make_groom({&line, 1}, options);
                for (std::uint32_t p = fold + 1; p < 32; ++p)
                    groom.guide_position[vector_index(groom.tile_first_row[0] + p, 3, 0, 0)] =
                        float(2 * line[fold][0] - line[p][0]);
                Simulation s = made(groom, single_thread());
                run(s, 6, 1.0 / 60);
                double fastest = 0;
                for (std::uint32_t p = 2; p < 32; ++p) fastest = std::max(fastest, speed(s, 0, p));
                at_rest += fastest < 0.001;
            }
    CHECK(at_rest == 36);
}

TEST_CASE("hair at rest keeps still when the step changes") {
    scenes::GroomOptions options;
    options.group.strand.damping = {0.1f};
    const scenes::Line line = scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.15, 32);
    const scenes::Groom groom = scenes::make_groom({&line, 1}, options);
    Simulation s = made(groom, single_thread());
    run(s, 20, 1.0 / 60);
    double fastest = 0;
    for (const double h : {1.0 / 60, 1e-3, 1.0 / 30, 1e-4, 0.05, 2e-4, 2e-4, 1.0 / 240}) {
        must(s.step(h));
        for (std::uint32_t p = 2; p < 32; ++p) fastest = std::max(fastest, speed(s, 0, p));
    }
    INFO(fastest << " m/s");
    CHECK(fastest < 1e-3);
}

TEST_CASE("a strand too stiff for the step sags no more than it should") {
    // 15 um long and 10 nm thick: in a small step it could fall ten times its length.
    const double length = 15e-6, radius = 5e-9;
    const scenes::Line line = scenes::straight_line({0, 0, 0}, {1, 0, 0}, length, 32);
    scenes::GroomOptions options;
    options.group.material.radius = options.group.material.radius2 = float(radius);
    options.group.material.youngs_modulus = 3e9f;
    const scenes::Groom groom = scenes::make_groom({&line, 1}, options);
    Simulation s = made(groom, single_thread());
    run(s, 2, 1.0 / 60);
    // of a beam clamped where the carried segment ends: q L^4 / (8 E I)
    const double free = length * 30 / 31,
                 q_over_stiffness = 1300 * 9.81 * 4 / (3e9 * radius * radius);
    const double exact = q_over_stiffness * std::pow(free, 4) / 8;
    const double sag = -tip(s, 0)[1];
    INFO(sag / exact << " of the exact sag");
    // the sums of the stiffest system that float can hold are good to some per cent
    CHECK(std::fabs(sag / exact - 1) < 0.1);
}
