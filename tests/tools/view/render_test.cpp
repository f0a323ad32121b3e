#include "tools/keratin-view/render.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace keratin;
using namespace keratin::view;

namespace {

// Strands and what they refer to.
struct Hair {
    std::vector<std::uint32_t> first_point{0};
    std::vector<float> position, radius;
    std::vector<Float3> color;

    void add(const std::vector<Float3>& points, float r, Float3 c) {
        for (const Float3 p : points) {
            for (const float v : {p.x, p.y, p.z}) position.push_back(v);
            radius.push_back(r);
            color.push_back(c);
        }
        first_point.push_back(std::uint32_t(radius.size()));
    }
    StrandCurves curves(HairShading shading = HairShading::marschner,
                        CurveShape shape = CurveShape::smooth) const {
        return {first_point, position, radius, color, shading, shape};
    }
};

// Strands that hang from a disc, with some waves.
Hair wig(int count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> number(-1, 1);
    Hair hair;
    for (int s = 0; s < count; ++s) {
        const Float3 root{0.3f * number(random), 0.5f, 0.3f * number(random)};
        const float phase = 3 * number(random);
        std::vector<Float3> points;
        for (int p = 0; p < 8; ++p)
            points.push_back(root + Float3{0.03f * std::sin(phase + p), -0.12f * p,
                                           0.03f * std::cos(phase + p)});
        hair.add(points, 0.004f, {0.3f, 0.15f, 0.08f});
    }
    return hair;
}

struct Plate {  // square at height y
    std::vector<float> position;
    std::vector<std::uint32_t> triangle{0, 1, 2, 0, 2, 3};
    explicit Plate(float y, float r = 0.6f) : position{-r, y, -r, -r, y, r, r, y, r, r, y, -r} {}
    Surface surface() const { return {position, triangle, {0.6f, 0.6f, 0.6f}}; }
};

Image drawn(const std::vector<StrandCurves>& strands, const std::vector<Surface>& surfaces,
            const Camera& camera, int size, int samples = 4, int threads = 1) {
    RenderSettings settings;
    settings.width = settings.height = size;
    settings.samples = samples;
    settings.threads = threads;
    auto image = render(strands, surfaces, camera, settings);
    REQUIRE(image);
    return *image;
}

int difference(std::array<std::uint8_t, 3> a, std::array<std::uint8_t, 3> b) {
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}
int brightness(std::array<std::uint8_t, 3> c) { return c[0] + c[1] + c[2]; }

}  // namespace

TEST_CASE("a picture is the same for one and two threads, in every byte") {
    const Hair hair = wig(150);
    const Plate plate(-0.5f);
    const Camera camera = frame_camera(hair.position, {}, 90, 90);
    for (const CurveShape shape : {CurveShape::smooth, CurveShape::straight}) {
        const Image one = drawn({hair.curves(HairShading::marschner, shape)}, {plate.surface()},
                                camera, 90, 4, 1);
        const Image two = drawn({hair.curves(HairShading::marschner, shape)}, {plate.surface()},
                                camera, 90, 4, 2);
        CHECK(one.rgb == two.rgb);
        CHECK(one.rgb == drawn({hair.curves(HairShading::marschner, shape)}, {plate.surface()},
                               camera, 90, 4, 2)
                             .rgb);
    }
}

TEST_CASE("a strand covers the pixels where its points project to, and no others") {
    const int size = 120;
    const Camera camera{{0.2f, 0.3f, 3}, {0, 0, 0}};
    const Image empty = drawn({}, {}, camera, size);
    for (const CurveShape shape : {CurveShape::smooth, CurveShape::straight}) {
        Hair hair;
        hair.add(
            {{-0.4f, -0.3f, 0}, {-0.1f, -0.25f, 0.2f}, {0.1f, 0.1f, 0.1f}, {0.3f, 0.45f, -0.2f}},
            0.02f, {0.9f, 0, 0});
        const Image image = drawn({hair.curves(HairShading::flat, shape)}, {}, camera, size);
        for (std::size_t i = 0; i < hair.radius.size(); ++i) {
            const Projected p =
                project(camera, size, size,
                        {hair.position[3 * i], hair.position[3 * i + 1], hair.position[3 * i + 2]});
            CAPTURE(i, p.x, p.y);
            CHECK(difference(image.at(int(p.x), int(p.y)), empty.at(int(p.x), int(p.y))) > 60);
        }
        // Far from the box around the points nothing changes.
        int changed = 0;
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const bool far = x < 25 || x > 95 || y < 15 || y > 95;
                if (far) changed += difference(image.at(x, y), empty.at(x, y)) > 0;
            }
        CHECK(changed == 0);
    }
}

TEST_CASE("an empty scene is the background alone") {
    const Image image = drawn({}, {}, {}, 32);
    CHECK(image.width == 32);
    CHECK(brightness(image.at(16, 30)) > brightness(image.at(16, 1)));
    const Hair nothing;
    CHECK(drawn({nothing.curves()}, {}, {}, 32).rgb == image.rgb);
}

TEST_CASE("strands of fewer than two points are left out") {
    Hair hair;
    hair.add({{0, 0, 0}}, 0.1f, {1, 0, 0});
    hair.add({}, 0.1f, {1, 0, 0});
    const Camera camera{{0, 0, 3}, {0, 0, 0}};
    CHECK(drawn({hair.curves()}, {}, camera, 32).rgb == drawn({}, {}, camera, 32).rgb);
}

TEST_CASE("a surface hides the strand behind it") {
    Hair hair;
    hair.add({{-0.3f, -0.2f, 0}, {0.3f, -0.2f, 0}}, 0.02f, {0.9f, 0, 0});
    const Plate plate(0);
    const Camera from_above{{0, 3, 0.01f}, {0, 0, 0}};
    CHECK(drawn({hair.curves()}, {plate.surface()}, from_above, 64).rgb ==
          drawn({}, {plate.surface()}, from_above, 64).rgb);
}

TEST_CASE("hair throws a shadow on a surface") {
    // Above the picture's upper left, where the key light comes from, out of sight.
    const Plate plate(0, 3);
    const Camera camera{{0, 2, 2}, {0, 0, 0}};
    Hair hair;
    const CameraAxes axes = camera_axes(camera);
    const Float3 key = normalized(axes.right * -0.75f + Float3{0, 0.95f, 0} - axes.forward * 0.85f);
    for (int s = -30; s <= 30; ++s) {
        const Float3 middle = key * 4 + axes.right * (0.02f * s);
        hair.add({middle - axes.up * 0.8f, middle + axes.up * 0.8f}, 0.015f, {0.02f, 0.02f, 0.02f});
    }
    const Image lit = drawn({}, {plate.surface()}, camera, 48, 8);
    const Image shaded = drawn({hair.curves()}, {plate.surface()}, camera, 48, 8);
    const int under = brightness(lit.at(24, 24)) - brightness(shaded.at(24, 24));
    const int beside = brightness(lit.at(2, 24)) - brightness(shaded.at(2, 24));
    CAPTURE(under, beside);
    CHECK(under > 60);
    CHECK(beside < under / 2);
}

TEST_CASE("the ground lies under everything, as light as the background, and shows shadows") {
    Hair hair;
    for (int s = -20; s <= 20; ++s)
        hair.add({{0.01f * float(s), 0, 0}, {0.01f * float(s), 0.6f, 0}}, 0.006f,
                 {0.1f, 0.1f, 0.1f});
    const Camera camera{{0, 3, 3}, {0, 0.1f, 0}};
    RenderSettings settings;
    settings.width = settings.height = 64;
    settings.samples = 8;
    const std::vector<StrandCurves> strands{hair.curves()};
    const auto without = render(strands, {}, camera, settings);
    settings.ground = true;
    const auto with = render(strands, {}, camera, settings);
    REQUIRE(without);
    REQUIRE(with);
    CHECK(difference(without->at(2, 60), with->at(2, 60)) < 12);  // far from the hair
    int darker = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            darker += brightness(with->at(x, y)) < brightness(without->at(x, y)) - 60;
    CHECK(darker > 20);
}

TEST_CASE("a translucent surface shows what is behind it and throws no shadow") {
    Hair hair;
    hair.add({{-0.5f, 0, 0}, {0.5f, 0, 0}}, 0.05f, {0.9f, 0, 0});
    const Plate plate(0.4f);
    Surface glass = plate.surface();
    glass.opacity = 0.3f;
    const Camera from_above{{0, 3, 0.01f}, {0, 0, 0}};
    const auto clear = drawn({hair.curves(HairShading::flat)}, {}, from_above, 64, 32).at(32, 32);
    const auto through =
        drawn({hair.curves(HairShading::flat)}, {glass}, from_above, 64, 32).at(32, 32);
    const auto hidden =
        drawn({hair.curves(HairShading::flat)}, {plate.surface()}, from_above, 64, 32).at(32, 32);
    CHECK(through[0] - through[2] > 60);
    CHECK(hidden[0] - hidden[2] < 20);
    // Beside the strand the plate shows too.
    CHECK(difference(clear, through) > 10);
}

TEST_CASE("thin strands are widened to the pixels asked for, wide ones kept") {
    const Camera camera{{0, 0, 2}, {0, 0, 0}};
    const float position[] = {0, 0, 0, 0, 0, 1, 0, 0, 5};
    const float radius[] = {1e-5f, 0.1f, 1e-5f};
    const DrawnRadii drawn_radii = widen(position, radius, camera, 400, 1.5f);
    const float wanted = 0.75f * pixel_size(camera, 400, 2);
    CHECK(drawn_radii.radius[0] == Approx(wanted));
    CHECK(drawn_radii.radius[1] == 0.1f);
    CHECK(drawn_radii.radius[2] == 1e-5f);  // behind the camera
    CHECK(drawn_radii.widened == 1);
    CHECK(drawn_radii.largest_factor == Approx(wanted / 1e-5f));
}

TEST_CASE("what cannot be drawn is refused") {
    RenderSettings settings;
    settings.width = 0;
    CHECK(exit_code(render({}, {}, {}, settings).error()) == 2);
    settings.width = 10;
    settings.samples = 0;
    CHECK(exit_code(render({}, {}, {}, settings).error()) == 2);
    settings.samples = 1;
    Hair hair;
    hair.add({{0, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0}}, 0.1f, {});
    const std::vector<StrandCurves> strands{hair.curves()};
    const auto wrong = render(strands, {}, {}, settings);
    REQUIRE_FALSE(wrong);
    CHECK(wrong.error().code == ErrorCode::input);
    CHECK(to_string(wrong.error()).find("point 1") != std::string::npos);
}
