#include "bake/read/bytes.h"
#include "bake/read/formats.h"
#include "bake/read/read_curves.h"
#include "tests/bake/read/make_bytes.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <limits>

using namespace keratin;
using test::append;
using test::overwrite;

namespace {

const std::string kData = KERATIN_DATA_DIR;

// A version 4 file of two strands with three points; the first `fixed` points have w = 0.
std::string small_tfx4(int fixed) {
    std::string bytes;
    append(bytes, 4.0f);
    for (std::uint32_t field : {2u, 3u, 160u}) append(bytes, field);
    bytes.resize(160, '\0');
    for (int s = 0; s < 2; ++s)
        for (int p = 0; p < 3; ++p)
            for (float value : {float(s), float(p), 0.5f, p < fixed ? 0.0f : 1.0f})
                append(bytes, value);
    return bytes;
}

std::string message_of(const std::string& bytes) {
    const auto groom = read_tfx(bytes, "hair.tfx");
    REQUIRE(!groom);
    CHECK(groom.error().code == ErrorCode::input);
    return to_string(groom.error());
}

}  // namespace

TEST_CASE("a version 3 file gives its strands in order") {
    const auto groom = read_curves(kData + "/tressfx/tail.tfx");
    REQUIRE(groom);
    CHECK(groom->curves.size() == 255);
    CHECK(groom->problems.empty());
    CHECK(groom->fixed_points.empty());
    // The first and last values of the file's position block.
    const auto mapped = MappedFile::open(kData + "/tressfx/tail.tfx");
    REQUIRE(mapped);
    const std::string_view bytes = text_of(*mapped);
    const std::size_t end = 296 + 255 * 16 * 12;
    for (const RawCurve& curve : groom->curves) REQUIRE(curve.points.size() == 16);
    CHECK(groom->curves.front().points.front().x() == load<float>(bytes, 296));
    CHECK(groom->curves.back().points.back().z() == load<float>(bytes, end - 4));
}

TEST_CASE("a version 4 file marks the points that are carried") {
    const auto groom = read_curves(kData + "/tressfx/Ratboy_mohawk.tfx");
    REQUIRE(groom);
    CHECK(groom->curves.size() == 2228);
    CHECK(groom->root_uv.size() == 2228);
    REQUIRE(groom->fixed_points.size() == 2228);
    CHECK(groom->fixed_points[0] == 2);
    CHECK(groom->curves[0].points.size() == 32);
    const auto small = read_tfx(small_tfx4(1), "small.tfx");
    REQUIRE(small);
    CHECK(small->fixed_points == std::vector<std::uint32_t>{1, 1});
    CHECK(small->curves[1].points[2] == Vec3(1, 2, 0.5));
}

TEST_CASE("every TressFX groom in data is read whole") {
    const std::pair<const char*, std::size_t> files[] = {
        {"back", 517}, {"front_top", 876}, {"side", 3066}, {"bear", 48113}, {"TestHair1", 10027}};
    for (const auto& [name, strands] : files) {
        INFO(name);
        const auto groom = read_curves(kData + "/tressfx/" + name + ".tfx");
        REQUIRE(groom);
        CHECK(groom->curves.size() == strands);
        CHECK(groom->problems.empty());
    }
}

TEST_CASE("a cut or damaged .tfx file is refused with its fault") {
    const std::string whole = small_tfx4(1);
    REQUIRE(read_tfx(whole, "hair.tfx"));
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(!read_tfx(std::string_view(whole).substr(0, size), "hair.tfx"));
    CHECK(message_of(whole.substr(0, 100)).find("ends inside the header") != std::string::npos);
    CHECK(message_of(whole.substr(0, whole.size() - 1)).find("it is cut") != std::string::npos);
    std::string other = whole;
    overwrite(other, 0, 5.0f);
    CHECK(message_of(other) == "hair.tfx: this is not a .tfx file of version 3 or 4");
    other = whole;
    overwrite(other, 4, std::uint32_t{0xffffffff});
    overwrite(other, 8, std::uint32_t{0xffffffff});
    CHECK(message_of(other).find("it is cut") != std::string::npos);
    other = whole;
    overwrite(other, 8, std::uint32_t{1});
    CHECK(message_of(other) == "hair.tfx: a strand has 1 points, at least 2 are needed");
    other = whole;
    overwrite(other, 12, std::uint32_t{8});
    CHECK(message_of(other).find("inside the header") != std::string::npos);
    other = whole;
    overwrite(other, 16, std::uint32_t(whole.size() - 8));
    CHECK(message_of(other).find("texture coordinates") != std::string::npos);
}

TEST_CASE("a strand with a point that is not finite is left out and named") {
    std::string bytes = small_tfx4(1);
    overwrite(bytes, 160 + 4 * 16 + 4, std::numeric_limits<float>::quiet_NaN());
    const auto groom = read_tfx(bytes, "hair.tfx");
    REQUIRE(groom);
    REQUIRE(groom->curves.size() == 1);
    CHECK(groom->curves[0].index == 0);
    REQUIRE(groom->problems.size() == 1);
    CHECK(groom->problems[0].curve == 1);
    CHECK(groom->problems[0].what == "point 1 is not finite or is immensely far away");
    CHECK(groom->fixed_points.size() == 1);
}

TEST_CASE("bones of a groom come by name with four weights a strand") {
    const auto skin = read_skin(kData + "/tressfx/Ratboy_mohawk.tfxbone");
    REQUIRE(skin);
    CHECK(skin->bones.size() == 105);
    CHECK(skin->bones[0] == "frenchHornMonster_head_JNT");
    REQUIRE(skin->bone.size() == 2228);
    REQUIRE(skin->weight.size() == 2228);
    double smallest = 2, largest = 0;
    for (const auto& weight : skin->weight) {
        const double sum = weight[0] + weight[1] + weight[2] + weight[3];
        smallest = std::min(smallest, sum);
        largest = std::max(largest, sum);
    }
    CHECK(smallest > 0.91);
    CHECK(largest < 1.0001);
}

TEST_CASE("a damaged .tfxbone file is refused with its fault") {
    std::string bytes;
    append(bytes, std::int32_t{1});
    append(bytes, std::int32_t{0});
    append(bytes, std::int32_t{5});
    bytes.append("head", 5);
    append(bytes, std::int32_t{1});
    append(bytes, std::int32_t{0});
    for (int k = 0; k < 4; ++k) {
        append(bytes, std::int32_t{k == 0 ? 0 : -1});
        append(bytes, k == 0 ? 1.0f : 0.0f);
    }
    REQUIRE(read_tfxbone(bytes, "a.tfxbone"));
    for (std::size_t size = 0; size < bytes.size(); ++size)
        CHECK(!read_tfxbone(std::string_view(bytes).substr(0, size), "a.tfxbone"));
    std::string other = bytes;
    overwrite(other, 25, std::int32_t{7});  // the first bone of the strand
    const auto skin = read_tfxbone(other, "a.tfxbone");
    REQUIRE(!skin);
    CHECK(to_string(skin.error()) == "a.tfxbone: strand 0: bone 7 is out of range (1 bones)");
}
