#include "tools/keratin-view/hair_shading.h"

#include "tools/keratin-view/color.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

using namespace keratin::view;

namespace {
// Mean over the sphere times its area, on a spiral of n directions.
template <class Function>
Float3 over_sphere(int n, Function&& f) {
    Float3 sum;
    for (int i = 0; i < n; ++i) {
        const float z = 1 - (2 * i + 1.0f) / n, r = std::sqrt(1 - z * z);
        const float phi = float(2 * std::numbers::pi * std::fmod(i * std::numbers::phi, 1.0));
        sum += f(Float3{r * std::cos(phi), r * std::sin(phi), z});
    }
    return sum * (4 * std::numbers::pi_v<float> / n);
}
}  // namespace

TEST_CASE("hair without pigment scatters all light that meets it, whatever the angle") {
    const HairSurface surface;
    const HairColor white{{1, 1, 1}, {0, 0, 0}};
    const Float3 tangent{0, 0, 1};
    for (const float sine : {0.0f, 0.5f, -0.8f})
        for (const float offset : {0.0f, 0.6f, -0.9f}) {
            const Float3 to_eye{std::sqrt(1 - sine * sine), 0, sine};
            const Float3 total = over_sphere(20000, [&](Float3 w) {
                return marschner(white, surface, tangent, offset, to_eye, w);
            });
            CAPTURE(sine, offset, total.x);
            CHECK(total.x == Approx(1).epsilon(0.03));
        }
}

TEST_CASE("darker hair scatters less light, in its own colour") {
    const HairSurface surface;
    const Float3 tangent{0, 0, 1}, to_eye{1, 0, 0};
    float before = 2;
    for (const Float3 color :
         {Float3{0.8f, 0.6f, 0.4f}, Float3{0.2f, 0.1f, 0.05f}, Float3{0.02f, 0.012f, 0.008f}}) {
        const HairColor hair = hair_color(color);
        const Float3 total = over_sphere(
            5000, [&](Float3 w) { return marschner(hair, surface, tangent, 0.3f, to_eye, w); });
        CHECK(total.x < before);
        CHECK(total.x > total.y);
        CHECK(total.y > total.z);
        before = total.x;
    }
}

TEST_CASE("the highlight of Kajiya and Kay stands on the mirrored cone") {
    const HairColor hair = hair_color({0.2f, 0.1f, 0.05f});
    const Float3 tangent{0, 0, 1}, to_eye = normalized({1, 0, 0.5f});
    const float mirrored = kajiya_kay(hair, tangent, to_eye, normalized({1, 0, -0.5f})).y;
    CHECK(mirrored > 2 * kajiya_kay(hair, tangent, to_eye, normalized({1, 0, 0.5f})).y);
    CHECK(mirrored > 2 * kajiya_kay(hair, tangent, to_eye, normalized({1, 0, -1.8f})).y);
}

TEST_CASE("hair colours are known by name or as #rrggbb") {
    CHECK(parse_hair_color("#ffffff")->x == Approx(1));
    CHECK(parse_hair_color("blond")->x > parse_hair_color("brown")->x);
    for (const char* text : {"", "bronde", "#12345", "#12345g", "123456"}) {
        CAPTURE(text);
        const auto wrong = parse_hair_color(text);
        REQUIRE_FALSE(wrong);
        CHECK(wrong.error().message.find("auburn") != std::string::npos);
    }
}

TEST_CASE("strands of one colour differ a little, the same strand never") {
    const Float3 brown = *parse_hair_color("brown");
    float least = 10, most = 0;
    for (std::uint32_t id = 0; id < 500; ++id) {
        const Float3 c = vary_hair_color(brown, id);
        CHECK(c == vary_hair_color(brown, id));
        least = std::min(least, c.y);
        most = std::max(most, c.y);
    }
    CHECK(least < 0.85f * brown.y);
    CHECK(least > 0.4f * brown.y);
    CHECK(most > 1.15f * brown.y);
}

TEST_CASE("the ramp grows lighter, velocity colours differ by direction") {
    float before = -1;
    for (int i = 0; i <= 10; ++i) {
        const Float3 c = ramp_color(0.1f * i);
        const float light = 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
        CHECK(light > before);
        before = light;
    }
    const Float3 rest = velocity_color({}, 1), east = velocity_color({1, 0, 0}, 1),
                 west = velocity_color({-1, 0, 0}, 1);
    CHECK(rest.x == rest.y);
    CHECK(length(east - west) > 0.3f);
    CHECK(length(velocity_color({0.01f, 0, 0}, 1) - rest) < 0.05f);
}

TEST_CASE("a texture repeats and its first row is on top") {
    keratin::view::Image texture = make_image(2, 2, {0, 0, 0});
    paste(make_image(1, 1, {255, 0, 0}), 0, 0, texture);  // top left
    CHECK(texture_color(texture, 0.25f, 0.75f).x == Approx(1));
    CHECK(texture_color(texture, 1.25f, -0.25f).x == Approx(1));
    CHECK(texture_color(texture, 0.25f, 0.25f).x == 0);
}
