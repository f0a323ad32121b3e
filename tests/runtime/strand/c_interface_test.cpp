#include <catch2/catch.hpp>
#include <cstring>
#include <new>

#include "bake/write.h"
#include "runtime/keratin.h"
#include "tests/runtime/strand/strand_scene.h"

using namespace keratin;
using namespace keratin::test;

TEST_CASE("the C interface runs an asset as the C++ one does") {
    scenes::GroomOptions options;
    options.group.name = "default";
    options.guide_every = 2;
    const scenes::Groom groom = head(64, 12, 0.2, options);
    auto bytes = serialise_asset(groom.info, groom.fields, "groom");
    REQUIRE(bytes);
    auto* aligned = static_cast<std::byte*>(::operator new(bytes->size(), std::align_val_t{64}));
    std::memcpy(aligned, bytes->data(), bytes->size());

    char message[200] = "";
    keratin_asset* asset = keratin_asset_from_memory(aligned, bytes->size(), message, sizeof message);
    INFO(message);
    REQUIRE(asset != nullptr);
    keratin_capsule capsule{{0, 0, 0}, {0, 0, 0}, 0.09f, 0.3f, 0};
    keratin_settings settings = keratin_default_settings();
    settings.threads = 1;
    settings.capsules = &capsule;
    settings.capsule_count = 1;
    keratin_simulation* hair = keratin_create(asset, &settings, message, sizeof message);
    REQUIRE(hair != nullptr);

    Settings same = single_thread();
    same.colliders.push_back({CapsuleCollider{{0, 0, 0}, {0, 0, 0}, 0.09f}});
    Simulation reference = made(groom, same);
    for (int i = 1; i <= 10; ++i) {
        const RigidTransform t = shaken(i / 60.0);
        keratin_transform c;
        std::copy(t.translation.begin(), t.translation.end(), c.translation);
        std::copy(t.rotation.begin(), t.rotation.end(), c.rotation);
        REQUIRE(keratin_set_motion(hair, &c) == KERATIN_OK);
        REQUIRE(keratin_set_capsule(hair, 0, &c) == KERATIN_OK);
        REQUIRE(keratin_step(hair, 1.0 / 60) == KERATIN_OK);
        must(reference.set_motion(t));
        must(reference.set_collider(0, t));
        must(reference.step(1.0 / 60));
    }
    keratin_strands strands;
    keratin_get_strands(hair, &strands);
    REQUIRE(strands.strand_count == 64);
    const auto expected = reference.strands().position;
    for (std::size_t i = 0; i < expected.size(); ++i) REQUIRE(strands.position[i] == expected[i]);
    keratin_stats stats;
    keratin_get_stats(hair, &stats);
    CHECK(stats.steps == 10);
    CHECK(stats.bytes == reference.stats().bytes);

    // What stands in tiles is what the C++ interface hands out.
    keratin_guides guides;
    keratin_get_guides(hair, &guides);
    REQUIRE(guides.tile_count == groom.info.tile_count);
    const Point expected_tip = tip(reference, 3);
    for (std::uint32_t c = 0; c < 3; ++c)
        CHECK(double(guides.position[((guides.tile_first_row[0] + 11) * 3 + c) * 16 + 3]) ==
              expected_tip[c]);
    CHECK(guides.previous_step == reference.guides().previous_step);

    CHECK(keratin_step(hair, -1) == KERATIN_INPUT);
    const keratin_transform still{{0, 0, 0}, {0, 0, 0, 1}};
    CHECK(keratin_set_capsule(hair, 1, &still) == KERATIN_INPUT);
    keratin_destroy(hair);

    // A host's memory and messages, and colliders of other shapes.
    struct Heap {
        std::size_t now = 0;
        std::string said;
    } heap;
    settings.host = {&heap,
                     [](void* user, std::size_t size, std::size_t alignment) -> void* {
                         static_cast<Heap*>(user)->now += size;
                         return ::operator new(size, std::align_val_t{alignment});
                     },
                     [](void* user, void* p, std::size_t size, std::size_t alignment) {
                         static_cast<Heap*>(user)->now -= size;
                         ::operator delete(p, std::align_val_t{alignment});
                     },
                     [](void* user, keratin_log_level, const char* line) {
                         static_cast<Heap*>(user)->said += line;
                     },
                     nullptr};
    const float corner[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    keratin_collider more[5] = {};
    more[0] = {KERATIN_SPHERE, {0, 0, 0}, {}, 0.05f, 0.3f, 0, 0, {}, nullptr};
    more[1] = {KERATIN_CAPSULE, {0, 0, 0}, {0, 0.1f, 0}, 0.05f, 0.3f, 0, 0, {}, nullptr};
    more[2] = {KERATIN_BOX, {0, 0, 0}, {0.1f, 0.1f, 0.1f}, 0, 0.3f, 0, 0, {}, nullptr};
    more[3] = {KERATIN_PLANE, {0, -1, 0}, {0, 1, 0}, 0, 0.3f, 0, 0, {}, nullptr};
    more[4] = {KERATIN_GRID, {0, 0, 0}, {}, 0, 0.3f, 0, 0.1f, {2, 2, 2}, corner};
    settings.colliders = more;
    settings.collider_count = 5;
    settings.previous = 1;
    hair = keratin_create(asset, &settings, message, sizeof message);
    INFO(message);
    REQUIRE(hair != nullptr);
    CHECK(heap.now > 0);
    CHECK(heap.said.find("render strands") != std::string::npos);
    CHECK(keratin_set_collider(hair, 5, &still) == KERATIN_OK);
    CHECK(keratin_set_collider(hair, 6, &still) == KERATIN_INPUT);
    const float gravity[3] = {0, -1, 0}, wind[3] = {1, 0, 0};
    CHECK(keratin_set_gravity(hair, gravity) == KERATIN_OK);
    CHECK(keratin_set_wind(hair, wind, 0.5f, 2) == KERATIN_INPUT);
    CHECK(keratin_step(hair, 1.0 / 60) == KERATIN_OK);
    keratin_get_strands(hair, &strands);
    CHECK(strands.previous != nullptr);
    keratin_destroy(hair);
    CHECK(heap.now == 0);
    more[4].distance = nullptr;
    CHECK(keratin_create(asset, &settings, message, sizeof message) == nullptr);
    CHECK(std::string(message).find("grid") != std::string::npos);
    settings.lod = 2;
    CHECK(keratin_create(asset, &settings, message, sizeof message) == nullptr);
    CHECK(std::string(message).find("lod") != std::string::npos);
    keratin_asset_close(asset);
    ::operator delete(aligned, std::align_val_t{64});
    CHECK(keratin_asset_open("/nowhere.kera", message, sizeof message) == nullptr);
    CHECK(keratin_abi_version() == KERATIN_ABI_VERSION);
}
