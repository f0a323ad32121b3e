#include "tools/keratin-view/difference.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace keratin;
using namespace keratin::view;

namespace {

// Upright strands side by side, 1 cm apart.
Subject comb(std::initializer_list<std::uint32_t> ids) {
    Subject subject;
    for (const std::uint32_t id : ids) {
        for (int p = 0; p < 4; ++p)
            subject.hair.position.insert(subject.hair.position.end(),
                                         {0.01f * float(id), 0.02f * float(p), 0});
        subject.hair.first_point.push_back(subject.hair.first_point.back() + 4);
        subject.hair.id.push_back(id);
        subject.hair.radius.push_back(5e-5f);
    }
    return subject;
}

DifferenceOptions small() {
    DifferenceOptions options;
    options.render.width = options.render.height = 96;
    options.render.samples = 4;
    options.angles = {0, 0, {}};
    return options;
}

// Pixels whose channels differ much: coloured ones.
int colorful(const Image& image) {
    int count = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
        const auto [least, most] = std::minmax({image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]});
        count += most - least > 60;
    }
    return count;
}

}  // namespace

TEST_CASE("equal grooms differ nowhere and are drawn in grey") {
    const auto result = draw_difference(comb({0, 1, 2, 3}), comb({0, 1, 2, 3}), small());
    REQUIRE(result);
    CHECK(result->largest == 0);
    CHECK(result->only_a == 0);
    CHECK(result->only_b == 0);
    CHECK(colorful(result->image) == 0);
}

TEST_CASE("a difference is measured between strands of the same id, whatever their order") {
    Subject b = comb({3, 2, 1, 0});
    CHECK(draw_difference(comb({0, 1, 2, 3}), b, small())->largest == 0);
    b.hair.position[3 * 3 + 2] += 0.004f;  // the tip of strand 3
    const auto result = draw_difference(comb({0, 1, 2, 3}), b, small());
    REQUIRE(result);
    CHECK(result->largest == Approx(0.004f));
    CHECK(colorful(result->image) > 10);
}

TEST_CASE("strands that only one groom has are counted and coloured") {
    const auto result = draw_difference(comb({0, 1, 2}), comb({1, 2, 3, 4}), small());
    REQUIRE(result);
    CHECK(result->only_a == 1);
    CHECK(result->only_b == 2);
    CHECK(colorful(result->image) > 40);
}

TEST_CASE("strands of different point counts are compared by their share of length") {
    Subject b = comb({0});
    b.hair.position = {0, 0, 0, 0, 0.06f, 0};
    b.hair.first_point = {0, 2};
    CHECK(draw_difference(comb({0}), b, small())->largest == Approx(0).margin(1e-7));
    CHECK(draw_difference(b, comb({0}), small())->largest == Approx(0).margin(1e-7));
}
