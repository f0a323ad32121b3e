#include "tools/keratin-view/subject.h"

#include "tests/tools/view/small_run.h"
#include "tools/keratin-view/collider_mesh.h"
#include "tools/keratin-view/draw.h"
#include "tools/keratin-view/voxels.h"

#include <catch2/catch.hpp>

using namespace keratin;
using namespace keratin::view;
using keratin::test::Folder;

TEST_CASE("an asset at rest shows its strands, guides, mesh and colliders") {
    const Folder folder("rest");
    const auto small = test::small_asset();
    test::write_small_asset(folder.file("a.kera"), small);
    const auto source = open_source(folder.file("a.kera"), "");
    REQUIRE(source);
    CHECK(frame_count(*source) == 1);
    const auto subject = subject_at(*source, 0);
    REQUIRE(subject);
    CHECK(subject->hair.position == small.strand_position);
    CHECK(subject->hair.id.size() == small.info.strand_count);
    CHECK(subject->hair.uv == small.strand_uv);
    CHECK(subject->guides.id.size() == small.info.guide_count);
    // Guide 2 is strand 2 in this asset.
    for (std::size_t c = 0; c < 12; ++c)
        CHECK(subject->guides.position[2 * 12 + c] == small.strand_position[2 * 12 + c]);
    REQUIRE(subject->bodies.size() == 1);
    CHECK(subject->bodies[0].position == small.mesh_position);
    REQUIRE(subject->colliders.size() == 1);
    CHECK(subject->colliders[0].radius == 0.5f);
}

TEST_CASE("a frame of a run shows the strands as cached and the mesh carried along") {
    const Folder folder("frame");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    const auto source = open_source(folder.file("a.kcache"), "");
    REQUIRE(source);
    REQUIRE(frame_count(*source) == 4);
    const auto subject = subject_at(*source, 2);
    REQUIRE(subject);
    CHECK(subject->frame == 2);
    CHECK(subject->hair.position[4] == Approx(0.21f));
    CHECK(subject->guides.position[4] == Approx(0.21f));
    CHECK(subject->hair.radius[0] == 5e-5f);
    // Mesh vertex (-1, 0, -1), turned by 90 degrees about y and lifted by 0.2.
    REQUIRE(subject->bodies.size() == 1);
    CHECK(subject->bodies[0].position[0] == Approx(-1));
    CHECK(subject->bodies[0].position[1] == Approx(0.2f));
    CHECK(subject->bodies[0].position[2] == Approx(1));
    CHECK(subject->colliders[0].a[1] == Approx(0.2f));
}

TEST_CASE("a run moved together with its asset still finds it") {
    const Folder folder("moved");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    std::filesystem::create_directories(folder.path / "there");
    for (const char* name : {"a.kera", "a.kcache"})
        std::filesystem::rename(folder.path / name, folder.path / "there" / name);
    CHECK(open_source(folder.file("there/a.kcache"), ""));
    std::filesystem::remove(folder.path / "there" / "a.kera");
    const auto missing = open_source(folder.file("there/a.kcache"), "");
    REQUIRE_FALSE(missing);
    CHECK(to_string(missing.error()).find("a.kera") != std::string::npos);
}

TEST_CASE("a run of another asset is refused") {
    const Folder folder("other");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    auto other = test::small_asset();
    other.strand_position[0] += 0.001f;
    test::write_small_asset(folder.file("a.kera"), other);
    for (const auto& source : {open_source(folder.file("a.kcache"), ""),
                               open_source(folder.file("a.kera"), folder.file("a.kcache"))}) {
        REQUIRE_FALSE(source);
        CHECK(to_string(source.error()).find("keratin-run") != std::string::npos);
    }
}

TEST_CASE("voxel values of a run come from its own velocities, or from the frames") {
    const Folder folder("voxels");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    const auto source = open_source(folder.file("a.kcache"), "");
    REQUIRE(source);
    // Stored: 3 m/s upwards at every point, and a density.
    auto stored = subject_at(*source, 3);
    REQUIRE(stored);
    const auto density = stored->hair.density;
    REQUIRE(add_voxel_values(*source, 3, *stored));
    CHECK(stored->hair.velocity[1] == Approx(3));
    CHECK(stored->hair.density == density);
    CHECK(usual_largest(*stored, HairColoring::velocity) == Approx(3));
    // Not stored: 10 cm up in a thirtieth of a second; nothing at frame 0 but what follows.
    for (const std::size_t frame : {std::size_t(3), std::size_t(2)}) {
        auto bare = subject_at(*source, frame);
        REQUIRE(bare);
        bare->hair.velocity.clear();
        bare->hair.density.clear();
        REQUIRE(add_voxel_values(*source, frame, *bare));
        for (std::size_t p = 0; p < bare->hair.id.size(); ++p)
            CHECK(bare->hair.velocity[3 * p + 1] == Approx(3).epsilon(1e-3));
        CHECK(bare->hair.density.size() == bare->hair.position.size() / 3);
    }
}

TEST_CASE("colours that the subject lacks are refused") {
    const Folder folder("colors");
    auto small = test::small_asset();
    small.strand_uv.clear();
    test::write_small_asset(folder.file("a.kera"), small);
    const auto source = open_source(folder.file("a.kera"), "");
    REQUIRE(source);
    const auto subject = subject_at(*source, 0);
    REQUIRE(subject);
    DrawOptions options;
    options.render.width = options.render.height = 16;
    options.render.samples = 1;
    options.texture = make_image(2, 2, {255, 0, 0});
    for (const HairColoring coloring :
         {HairColoring::texture, HairColoring::density, HairColoring::velocity}) {
        options.coloring = coloring;
        const auto drawn = draw(*subject, {}, options);
        REQUIRE_FALSE(drawn);
        CHECK(exit_code(drawn.error()) == 2);
    }
    options.coloring = HairColoring::strand;
    CHECK(draw(*subject, {}, options));
}

TEST_CASE("the automatic camera is given the hair, or everything shown") {
    Subject subject;
    subject.hair.position = {0, 0, 0, 1, 2, 3};
    subject.bodies.push_back({{-5, 0, 0, 0, 0, 0, 0, 1, 0}, {0, 1, 2}});
    DrawOptions options;
    const auto sees = [&](bool everything, Float3 point) {
        Framing framing({0, 0, {}}, 100, 100);
        include_shown(subject, options, everything, framing);
        const Projected p = project(framing.camera(), 100, 100, point);
        return p.depth > 0 && p.x > 0 && p.x < 100 && p.y > 0 && p.y < 100;
    };
    CHECK(sees(false, {1, 2, 3}));
    CHECK_FALSE(sees(false, {-5, 0, 0}));
    CHECK(sees(true, {1, 2, 3}));
    CHECK(sees(true, {-5, 0, 0}));
    options.show_hair = false;
    CHECK(sees(false, {-5, 0, 0}));
}

TEST_CASE("collider meshes lie on their colliders") {
    const auto distance_to_segment = [](Float3 p, Float3 a, Float3 b) {
        const float t =
            length(b - a) > 0 ? std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0f, 1.0f) : 0;
        return length(p - (a + (b - a) * t));
    };
    for (const CacheCollider& collider :
         {CacheCollider{CacheShape::sphere, {1, 2, 3}, {9, 9, 9}, 0.5f, {0, 0, 0, 1}},
          CacheCollider{CacheShape::capsule, {1, 2, 3}, {2, 4, 3}, 0.5f, {0, 0, 0, 1}}}) {
        const BodyMesh mesh = collider_mesh(collider, 1);
        const Float3 a{1, 2, 3}, b = collider.shape == CacheShape::capsule ? Float3{2, 4, 3} : a;
        for (std::size_t i = 0; i < mesh.position.size(); i += 3)
            CHECK(distance_to_segment(
                      {mesh.position[i], mesh.position[i + 1], mesh.position[i + 2]}, a, b) ==
                  Approx(0.5f).epsilon(1e-4));
        for (const std::uint32_t v : mesh.triangle) REQUIRE(v < mesh.position.size() / 3);
    }
    const BodyMesh box =
        collider_mesh({CacheShape::box, {1, 0, 0}, {0.1f, 0.2f, 0.3f}, 0, {0, 0, 0, 1}}, 1);
    CHECK(box.triangle.size() == 36);
    for (std::size_t i = 0; i < box.position.size(); i += 3) {
        CHECK(std::abs(box.position[i] - 1) == Approx(0.1f));
        CHECK(std::abs(box.position[i + 1]) == Approx(0.2f));
        CHECK(std::abs(box.position[i + 2]) == Approx(0.3f));
    }
}
