#include "tools/keratin-view/camera.h"

#include <catch2/catch.hpp>

#include <random>
#include <vector>

using namespace keratin;
using namespace keratin::view;

TEST_CASE("the automatic camera sees every point and fills the picture with them") {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> number(-1, 1);
    for (int trial = 0; trial < 50; ++trial) {
        const Float3 stretch{0.1f + std::abs(number(random)), 0.1f + std::abs(number(random)),
                             0.1f + std::abs(number(random))};
        std::vector<float> points;
        for (int i = 0; i < 200; ++i)
            for (const float s : {stretch.x, stretch.y, stretch.z})
                points.push_back(3 + s * number(random));
        ViewAngles angles;
        angles.yaw_deg = 180 * number(random);
        angles.pitch_deg = 80 * number(random);
        const int width = 300, height = 200;
        const float margin = 0.05f;
        const Camera camera = frame_camera(points, angles, width, height, 35, margin);
        float left = width, right = 0, top = height, bottom = 0;
        for (std::size_t i = 0; i < points.size(); i += 3) {
            const Projected p =
                project(camera, width, height, {points[i], points[i + 1], points[i + 2]});
            REQUIRE(p.depth > 0);
            left = std::min(left, p.x), right = std::max(right, p.x);
            top = std::min(top, p.y), bottom = std::max(bottom, p.y);
        }
        CHECK(left > margin * width - 0.1f);
        CHECK(right < (1 - margin) * width + 0.1f);
        CHECK(top > margin * height - 0.1f);
        CHECK(bottom < (1 - margin) * height + 0.1f);
        const float filled = std::max((right - left) / width, (bottom - top) / height);
        CHECK(filled == Approx(1 - 2 * margin).margin(0.002));
    }
}

TEST_CASE("yaw 0 looks from +z, yaw 90 from +x, pitch 90 from above") {
    const float points[] = {-1, -1, -1, 1, 1, 1};
    ViewAngles angles{0, 0, 5.0f};
    CHECK(frame_camera(points, angles, 100, 100).position.z == Approx(5));
    angles.yaw_deg = 90;
    CHECK(frame_camera(points, angles, 100, 100).position.x == Approx(5));
    angles.pitch_deg = 80;
    CHECK(frame_camera(points, angles, 100, 100).position.y > 4.5f);
    const Camera camera{{0, 0, 5}, {0, 0, 0}};
    const CameraAxes axes = camera_axes(camera);
    CHECK(axes.right.x == Approx(1));
    CHECK(axes.up.y == Approx(1));
}

TEST_CASE("a camera without points sees a metre around the origin") {
    const Camera camera = frame_camera({}, {}, 100, 100);
    const Projected p = project(camera, 100, 100, {0, 0, 0});
    CHECK(p.depth > 0.5f);
    CHECK(p.x == Approx(50).margin(5));
    CHECK(p.y == Approx(50).margin(5));
}

TEST_CASE("a camera on the command line is two or three numbers in range") {
    const auto angles = parse_view_angles("215, -8,0.6");
    REQUIRE(angles);
    CHECK(angles->yaw_deg == 215);
    CHECK(angles->pitch_deg == -8);
    CHECK(angles->distance == 0.6f);
    for (const char* text :
         {"", "1", "1,2,3,4", "a,b", "1,2x", "1,", "nan,1", "0,90", "0,0,0", "0,0,-1"}) {
        CAPTURE(text);
        const auto wrong = parse_view_angles(text);
        REQUIRE_FALSE(wrong);
        CHECK(exit_code(wrong.error()) == 2);
        CHECK(to_string(wrong.error()).find("--camera") == 0);
    }
    CHECK(parse_point("1,2,-3.5")->z == -3.5f);
    CHECK_FALSE(parse_point("1,2"));
}
