// The scenes of tools/demo do what their first lines say.
#include "bake/read/read_curves.h"
#include "schema/read/scene.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

using namespace keratin;

namespace {

Scene demo_scene(const std::string& name) {
    auto scene = read_scene(KERATIN_DATA_DIR "/scenes/" + name);
    if (!scene) FAIL(to_string(scene.error()));
    return *scene;
}

double yaw_deg(const Keyframe& key) {
    return 2 * std::atan2(key.rotation[1], key.rotation[3]) * 180 / std::numbers::pi;
}

}  // namespace

TEST_CASE("the head is shaken by 40 degrees and 10 cm to either side for 5 s at 1 Hz") {
    const Scene scene = demo_scene("head_shake.json");
    REQUIRE(scene.assets.size() == 1);
    const Motion& motion = scene.assets[0].motion;
    REQUIRE(motion.size() == 301);
    double most = 0, least = 0, right = 0, left = 0;
    int crossings = 0;
    for (std::size_t i = 0; i < motion.size(); ++i) {
        // The axis of the neck, (0, y, 0.03), shows the sideways shift without the turn.
        const double angle = yaw_deg(motion[i]) * std::numbers::pi / 180;
        const double shift = motion[i].translation[0] + 0.03 * std::sin(angle);
        most = std::max(most, yaw_deg(motion[i])), least = std::min(least, yaw_deg(motion[i]));
        right = std::max(right, shift), left = std::min(left, shift);
        CHECK(motion[i].rotation[0] == 0);
        CHECK(motion[i].rotation[2] == 0);
        if (i > 0) {
            CHECK(motion[i].time - motion[i - 1].time == Approx(1.0 / 60).epsilon(1e-4));
            crossings += yaw_deg(motion[i]) * yaw_deg(motion[i - 1]) < 0;
        }
    }
    CHECK(most == Approx(40).margin(0.1));
    CHECK(least == Approx(-40).margin(0.1));
    CHECK(right == Approx(0.10).margin(1e-3));
    CHECK(left == Approx(-0.10).margin(1e-3));
    CHECK(motion.back().time - motion.front().time == Approx(5));
    CHECK(yaw_deg(motion.front()) == 0);
    CHECK(yaw_deg(motion.back()) == 0);
    CHECK(*scene.duration > motion.back().time);
    CHECK(crossings <= 10);
}

TEST_CASE("the mohawk's pose file moves every bone that carries hair, without a gap between them") {
    const Scene scene = demo_scene("mohawk.json");
    REQUIRE(scene.assets.size() == 1);
    const auto& bones = scene.assets[0].bones;
    const auto skin = read_skin(KERATIN_DATA_DIR "/tressfx/Ratboy_mohawk.tfxbone");
    REQUIRE(skin);
    std::vector<double> load(skin->bones.size(), 0);
    for (std::size_t s = 0; s < skin->bone.size(); ++s)
        for (int k = 0; k < 4; ++k) load[skin->bone[s][k]] += skin->weight[s][k];
    // Hips and legs stand still.
    const auto rests = [](const std::string& name) {
        return name.find("pelvis") != std::string::npos || name.find("ULeg") != std::string::npos;
    };
    for (std::size_t b = 0; b < load.size(); ++b) {
        const bool moved = std::any_of(bones.begin(), bones.end(), [&](const BoneMotion& m) {
            return m.bone == skin->bones[b];
        });
        CAPTURE(skin->bones[b], load[b]);
        if (load[b] > 0.01) CHECK(moved != rests(skin->bones[b]));
    }
    for (const BoneMotion& motion : bones)
        CHECK(std::find(skin->bones.begin(), skin->bones.end(), motion.bone) != skin->bones.end());

    // A bone turns about its joint: the joint goes where its parent takes it.
    const auto at = [&](const std::string& name, double x, double y, double z) {
        for (const BoneMotion& m : bones)
            if (m.bone == "frenchHornMonster_" + name + "_JNT") {
                const Keyframe& key = m.motion[8];
                const auto [qx, qy, qz, qw] = key.rotation;
                const double tx = 2 * (qy * z - qz * y), ty = 2 * (qz * x - qx * z),
                             tz = 2 * (qx * y - qy * x);
                return Double3{x + qw * tx + qy * tz - qz * ty + key.translation[0],
                               y + qw * ty + qz * tx - qx * tz + key.translation[1],
                               z + qw * tz + qx * ty - qy * tx + key.translation[2]};
            }
        FAIL(name);
        return Double3{};
    };
    const auto distance = [](const Double3& a, const Double3& b) {
        return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    };
    CHECK(distance(at("neck", 0, 0.70, -0.01), at("head", 0, 0.70, -0.01)) < 1e-6);
    CHECK(distance(at("spine02", 0, 0.514, -0.056), at("spine03", 0, 0.514, -0.056)) < 1e-6);
    CHECK(distance(at("head", 0, 0.70, -0.01), {0, 0.70, -0.01}) > 0.05);
}

TEST_CASE("the ponytail of NURBS nods by 25 degrees") {
    const Scene scene = demo_scene("nurbs_tail.json");
    double most = 0;
    for (const Keyframe& key : scene.assets.at(0).motion)
        most = std::max(most,
                        2 * std::atan2(key.rotation[0], key.rotation[3]) * 180 / std::numbers::pi);
    CHECK(most == Approx(25).margin(0.1));
}
