#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>

using namespace keratin;
using namespace keratin::test;

namespace {

SolverPlan plan_of(const scenes::GroomOptions& options, const Settings& settings) {
    const scenes::Groom g = head(96, 8, 0.2, options);
    auto plan = make_plan(g.info, g.fields, settings);
    REQUIRE(plan);
    return *plan;
}

scenes::GroomOptions plain() {
    scenes::GroomOptions o;
    o.guide_every = 4;
    return o;
}

std::string reason(const SolverPlan& plan, const std::string& name) {
    for (const LeftOut& l : plan.left_out)
        if (l.name == name) return l.reason;
    return {};
}

}  // namespace

TEST_CASE("without friction and volume there is no grid") {
    const SolverPlan plan = plan_of(plain(), single_thread());
    CHECK_FALSE(plan.has(PassId::grid_scatter));
    CHECK_FALSE(plan.has(PassId::grid_gather));
    CHECK(plan.bytes(BufferId::grid_sum) == 0);
    CHECK(plan.bytes(BufferId::grid_field) == 0);
    CHECK(reason(plan, "grid_scatter") == "no friction and no volume in any group");
    scenes::GroomOptions o = plain();
    o.group.strand.friction = {0.0f, 0.1f};
    const SolverPlan with = plan_of(o, single_thread());
    CHECK(with.has(PassId::grid_scatter));
    CHECK(with.bytes(BufferId::grid_sum) > 0);
    // Mass and three of momentum with friction, the filling with volume.
    scenes::GroomOptions both = o;
    both.group.strand.volume = {0.1f};
    scenes::GroomOptions volume = plain();
    volume.group.strand.volume = {0.1f};
    const SolverPlan with_volume = plan_of(volume, single_thread());
    CHECK(plan_of(both, single_thread()).bytes(BufferId::grid_sum) * 4 ==
          with.bytes(BufferId::grid_sum) * 5);
    CHECK(with_volume.bytes(BufferId::grid_sum) * 4 == with.bytes(BufferId::grid_sum));
    CHECK(with_volume.bytes(BufferId::grid_field) * 4 == with.bytes(BufferId::grid_field));
}

TEST_CASE("without colliders there is no collision pass") {
    const SolverPlan plan = plan_of(plain(), single_thread());
    CHECK_FALSE(plan.has(PassId::collide));
    CHECK(plan.bytes(BufferId::collider) == 0);
    CHECK(reason(plan, "collide") == "no colliders");
    Settings settings = single_thread();
    settings.colliders.push_back({SphereCollider{{0, 0, 0}, 0.1f}});
    CHECK(plan_of(plain(), settings).has(PassId::collide));
}

TEST_CASE("without render strands nothing is interpolated") {
    Settings settings = single_thread();
    settings.lod = 0;
    const SolverPlan plan = plan_of(plain(), settings);
    CHECK_FALSE(plan.has(PassId::interpolate));
    CHECK(plan.bytes(BufferId::strand_position) == 0);
    CHECK(plan.bytes(BufferId::guide_line) == 0);
}

TEST_CASE("short hair that is only carried allocates nothing beyond its output") {
    scenes::GroomOptions o = plain();
    o.attach = Attach::all;
    const SolverPlan plan = plan_of(o, single_thread());
    CHECK(plan.passes.size() == 1);
    CHECK(plan.has(PassId::carry));
    for (const PlannedBuffer& b : plan.buffers)
        CHECK((b.id == BufferId::strand_position || b.id == BufferId::strand_root));
    CHECK(plan.total_bytes() == 96 * 8 * 12 + 28);
}

TEST_CASE("one rigid motion needs no skinning and no root of each strand") {
    const SolverPlan plan = plan_of(plain(), single_thread());
    CHECK_FALSE(plan.has(PassId::skin));
    CHECK(plan.bytes(BufferId::root) == 2 * 7 * 16 * 4);
    scenes::GroomOptions o = plain();
    o.bones = {"head"};
    o.bone_of_strand.assign(96, 0);
    CHECK(plan_of(o, single_thread()).has(PassId::skin));
}

TEST_CASE("every pass can be switched off by hand and says so") {
    scenes::GroomOptions o = plain();
    o.group.strand.friction = {0.1f};
    Settings settings = single_thread();
    settings.colliders.push_back({SphereCollider{{0, 0, 0}, 0.1f}});
    settings.passes = {false, false, false, false, false, false, false};
    const SolverPlan plan = plan_of(o, settings);
    CHECK(plan.passes.size() == 1);
    CHECK(plan.has(PassId::integrate));
    for (const char* name : {"local_shape", "stretch", "collide", "final_length", "interpolate"})
        CHECK(reason(plan, name) == "switched off");
    const std::string text = explain(plan);
    CHECK(text.find("left out:") != std::string::npos);
    CHECK(text.find("  stretch: switched off\n") != std::string::npos);
}

TEST_CASE("state and rest of a guide point take at most 40 bytes") {
    const SolverPlan plan = plan_of(plain(), single_thread());
    const scenes::Groom g = head(96, 8, 0.2, plain());
    const double points = double(g.info.row_count) * kTileLanes;
    const double state = double(plan.bytes(BufferId::position) + plan.bytes(BufferId::previous));
    const double rest =
        double(plan.bytes(BufferId::rest_edge)) + 4.0 * double(g.guide_length.size());
    CHECK((state + rest) / points <= 40);
}

TEST_CASE("a simulation allocates what its plan says") {
    const scenes::Groom g = head(96, 8, 0.2, plain());
    Simulation s = made(g, single_thread());
    CHECK(s.stats().bytes == s.plan().total_bytes());
    CHECK(s.guides().position.size() * 4 == s.plan().bytes(BufferId::position));
    CHECK(s.strands().position.size() * 4 == s.plan().bytes(BufferId::strand_position));
}

TEST_CASE("settings out of range are refused by name") {
    const scenes::Groom g = head(96, 8, 0.2, plain());
    const auto refused = [&](const Settings& settings) {
        auto plan = make_plan(g.info, g.fields, settings);
        REQUIRE_FALSE(plan);
        return plan.error().where;
    };
    Settings s = single_thread();
    s.gravity[1] = NAN;
    CHECK(refused(s) == "gravity");
    s = single_thread();
    s.lod = 1.5f;
    CHECK(refused(s) == "lod");
    s = single_thread();
    s.colliders.push_back({SphereCollider{{0, 0, 0}, 0.1f}});
    s.colliders.push_back({CapsuleCollider{{0, 0, 0}, {0, 1, 0}, -1}});
    CHECK(refused(s) == "colliders[1].radius");
    s = single_thread();
    s.colliders.push_back({PlaneCollider{{0, 0, 0}, {0, 2, 0}}});
    CHECK(refused(s) == "colliders[0].normal");
    s = single_thread();
    s.grid_resolution = 1000;
    CHECK(refused(s) == "grid_resolution");
}

TEST_CASE("guides of more than 32 points are refused with the way out") {
    const scenes::Groom g = head(64, 33, 0.2);
    auto plan = make_plan(g.info, g.fields, single_thread());
    REQUIRE_FALSE(plan);
    CHECK(plan.error().code == ErrorCode::unsupported);
    CHECK(plan.error().message.find("points_per_strand") != std::string::npos);
}

TEST_CASE("guides and materials that cannot be simulated are refused by name") {
    const auto refused = [](auto&& spoil) {
        scenes::Groom g = head(96, 8, 0.2, plain());
        spoil(g);
        auto plan = make_plan(g.info, g.fields, single_thread());
        REQUIRE_FALSE(plan);
        return to_string(plan.error());
    };
    CHECK(refused([](scenes::Groom& g) { g.guide_position[5 * 48 + 3] = NAN; }) ==
          "guide 3, point 5: must be finite");
    CHECK(refused([](scenes::Groom& g) { g.guide_length[5 * 16 + 3] = -1; }) ==
          "guide 3, segment 5: must have a finite length");
    CHECK(refused([](scenes::Groom& g) { g.guide_length[5 * 16 + 3] = 1e-7f; })
              .starts_with("guide 3: has a segment of 1e-07 m"));
    CHECK(refused([](scenes::Groom& g) { g.info.groups[0].material.radius = -1; })
              .starts_with("groups[0].material.radius"));
}
