// The formats that hold plain strands: .hair, .data, .tfxskin, glTF lines.
#include "bake/read/formats.h"
#include "bake/read/read_curves.h"
#include "bake/read/read_mesh.h"
#include "tests/bake/read/make_bytes.h"
#include "tests/data_dir.h"
#include "tests/temporary_folder.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <cstdio>
#include <cstring>
#include <limits>

using namespace keratin;
using test::append;
using test::overwrite;

namespace {

const std::string kData = KERATIN_DATA_DIR;

template <class T>
std::string message_of(const Result<T>& result) {
    if (result) return "no error";
    return to_string(result.error());
}

// Three strands of 2, 3 and 1 points with thickness.
std::string small_hair() {
    std::string bytes = "HAIR";
    for (std::uint32_t field : {3u, 6u, 7u, 0u}) append(bytes, field);
    bytes.resize(128, '\0');
    for (std::uint16_t segments : {1, 2, 0}) append(bytes, segments);
    for (int i = 0; i < 18; ++i) append(bytes, float(i));
    for (int i = 0; i < 6; ++i) append(bytes, 0.25f * float(i));
    return bytes;
}

std::string small_data(std::size_t floats) {
    std::string bytes;
    append(bytes, std::int32_t{3});
    float value = 0;
    for (std::int32_t count : {2, 1, 3}) {
        append(bytes, count);
        for (std::size_t i = 0; i < static_cast<std::size_t>(count) * floats; ++i)
            append(bytes, value++);
    }
    return bytes;
}

std::string small_skin() {
    std::string bytes;
    for (std::uint32_t field : {1u, 2u, 10u}) append(bytes, field);
    bytes.resize(136, '\0');
    append(bytes, std::uint32_t{268});
    append(bytes, std::uint32_t{268 + 48});
    bytes.resize(268, '\0');
    for (std::uint32_t triangle : {4u, 9u}) {
        append(bytes, std::uint32_t{0});
        append(bytes, triangle);
        for (float b : {0.25f, 0.25f, 0.5f}) append(bytes, b);
        append(bytes, std::uint32_t{0});
    }
    for (int i = 0; i < 6; ++i) append(bytes, 0.125f * float(i));
    return bytes;
}

// Five points on the x axis with a width each, then u16 indices of the edges 2-1, 0-1, 3-4.
std::string small_gltf_buffer() {
    std::string bytes;
    for (int i = 0; i < 5; ++i)
        for (float value : {float(i), 0.f, 0.f}) append(bytes, value);
    for (int i = 0; i < 5; ++i) append(bytes, 0.5f * float(i));
    for (std::uint16_t index : {2, 1, 0, 1, 3, 4}) append(bytes, index);
    return bytes;
}

std::string small_gltf(const std::string& primitive, const std::string& uri = "hair%20one.bin") {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
      "nodes":[{"name":"head","translation":[0,1,0],"children":[1]},{"name":"fringe","mesh":0,"scale":[2,2,2]}],
      "meshes":[{"primitives":[)" +
           primitive + R"(]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"},
                   {"bufferView":1,"componentType":5126,"count":5,"type":"SCALAR"},
                   {"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":60},{"buffer":0,"byteOffset":60,"byteLength":20},
                     {"buffer":0,"byteOffset":80,"byteLength":12}],
      "buffers":[{"uri":")" +
           uri + R"(","byteLength":92}]})";
}

Result<RawGroom> read_small_gltf(const std::string& json) {
    return read_gltf_curves(json, "g.gltf", [](const std::string&) -> Result<std::string> {
        return small_gltf_buffer();
    });
}

}  // namespace

TEST_CASE("the ponytail equals its TressFX strands in every format of strands") {
    const auto tfx = read_curves(kData + "/tressfx/tail.tfx");
    REQUIRE(tfx);
    Eigen::AlignedBox3d box;
    for (const RawCurve& curve : tfx->curves)
        for (const Vec3& point : curve.points) box.extend(point);
    for (const char* ending : {".hair", ".data", ".lines.obj", ".lines.glb"}) {
        INFO(ending);
        const auto groom = read_curves(kData + "/ponytail_formats/ponytail_tail" + ending);
        REQUIRE(groom);
        CHECK(groom->problems.empty());
        REQUIRE(groom->curves.size() == tfx->curves.size());
        double largest = 0;
        for (std::size_t s = 0; s < tfx->curves.size(); ++s) {
            REQUIRE(groom->curves[s].points.size() == tfx->curves[s].points.size());
            for (std::size_t p = 0; p < tfx->curves[s].points.size(); ++p)
                largest = std::max(largest,
                                   (groom->curves[s].points[p] - tfx->curves[s].points[p]).norm());
        }
        const double bound = 1e-5 * box.diagonal().norm();
        std::printf("%s against .tfx: largest distance %.3g, allowed %.3g\n", ending, largest,
                    bound);
        CHECK(largest <= bound);
    }
}

TEST_CASE("a .hair file gives strands of any length, and radii from its widths") {
    const auto groom = read_hair(small_hair(), "a.hair");
    REQUIRE(groom);
    REQUIRE(groom->curves.size() == 2);
    CHECK(groom->curves[1].points[2] == Vec3(12, 13, 14));
    REQUIRE(groom->point_radius.size() == 2);
    CHECK(groom->point_radius[1] == std::vector<double>{0.25, 0.375, 0.5});
    REQUIRE(groom->problems.size() == 1);
    CHECK(groom->problems[0].curve == 2);
    CHECK(groom->problems[0].what == "it has one point");
    // Without the array of segments all strands have the default.
    std::string even = "HAIR";
    for (std::uint32_t field : {2u, 4u, 2u, 1u}) append(even, field);
    even.resize(128, '\0');
    for (int i = 0; i < 12; ++i) append(even, float(i));
    const auto by_default = read_hair(even, "b.hair");
    REQUIRE(by_default);
    CHECK(by_default->curves.size() == 2);
    CHECK(by_default->point_radius.empty());
}

TEST_CASE("a cut or contradictory .hair file is refused") {
    const std::string whole = small_hair();
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(!read_hair(std::string_view(whole).substr(0, size), "a.hair"));
    std::string other = whole;
    overwrite(other, 8, std::uint32_t{7});
    CHECK(message_of(read_hair(other, "a.hair")) ==
          "a.hair: the strands have 6 points by their segments, but the header says 7");
    other = whole;
    overwrite(other, 12, std::uint32_t{5});
    CHECK(message_of(read_hair(other, "a.hair")) == "a.hair: the file holds no points");
    other = whole;
    overwrite(other, 12, std::uint32_t{32 + 7});
    CHECK(message_of(read_hair(other, "a.hair")) ==
          "a.hair: the file announces arrays that are not known");
    other = whole;
    overwrite(other, 4, std::uint32_t{0xffffffff});
    CHECK(!read_hair(other, "a.hair"));
    // Four thousand million strands that only a number in the header speaks of, and no array.
    other = whole;
    overwrite(other, 4, std::uint32_t{0xffffffff});
    overwrite(other, 12, std::uint32_t{2});
    CHECK(message_of(read_hair(other, "a.hair")) ==
          "a.hair: the strands have 4294967295 points by their segments, but the header says 6");
    other = whole;
    overwrite(other, 128 + 6 + 4, std::numeric_limits<float>::infinity());
    const auto groom = read_hair(other, "a.hair");
    REQUIRE(groom);
    CHECK(groom->curves.size() == 1);
    CHECK(groom->problems[0].what == "point 0 is not finite or is immensely far away");
}

TEST_CASE("a .data file is told by its length to have 3 or 7 numbers a point") {
    for (std::size_t floats : {3u, 7u}) {
        const auto groom = read_usc_data(small_data(floats), "a.data");
        REQUIRE(groom);
        REQUIRE(groom->curves.size() == 2);
        CHECK(groom->curves[1].index == 2);
        CHECK(groom->curves[1].points.size() == 3);
        CHECK(groom->curves[1].points[1].x() == 3.0 * double(floats) + double(floats));
        REQUIRE(groom->problems.size() == 1);
        CHECK(groom->problems[0].curve == 1);
    }
    const std::string whole = small_data(3);
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(!read_usc_data(std::string_view(whole).substr(0, size), "a.data"));
    CHECK(!read_usc_data(whole + "x", "a.data"));
    std::string other = whole;
    overwrite(other, 4, std::int32_t{0x7fffffff});
    CHECK(!read_usc_data(other, "a.data"));
}

TEST_CASE("a .tfxskin file binds each strand to a triangle") {
    const std::string whole = small_skin();
    const auto binding = read_tfxskin(whole, "a.tfxskin");
    REQUIRE(binding);
    CHECK(binding->mesh_triangle_count == 10);
    CHECK(binding->triangle == std::vector<std::uint32_t>{4, 9});
    CHECK(binding->barycentric[1] == std::array<double, 3>{0.25, 0.25, 0.5});
    CHECK(binding->uvw[1] == std::array<double, 3>{0.375, 0.5, 0.625});
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(!read_tfxskin(std::string_view(whole).substr(0, size), "a.tfxskin"));
    std::string other = whole;
    overwrite(other, 268 + 24 + 4, std::uint32_t{10});
    CHECK(message_of(read_tfxskin(other, "a.tfxskin")) ==
          "a.tfxskin: strand 1: triangle 10 is out of range (10 triangles)");
    const test::TemporaryFolder folder;
    CHECK(read_binding(folder.write("a.tfxskin", whole)));
}

TEST_CASE("glTF edges become chains and strips stay strands, placed by their nodes") {
    const auto lines = read_small_gltf(
        small_gltf(R"({"mode":1,"attributes":{"POSITION":0,"_WIDTH":1},"indices":2})"));
    if (!lines) FAIL(message_of(lines));
    REQUIRE(lines->curves.size() == 2);
    CHECK(lines->curves[0].points == std::vector<Vec3>{{0, 1, 0}, {2, 1, 0}, {4, 1, 0}});
    CHECK(lines->curves[1].points == std::vector<Vec3>{{6, 1, 0}, {8, 1, 0}});
    CHECK(lines->point_radius[1] == std::vector<double>{0.75, 1});
    CHECK(lines->group_names == std::vector<std::string>{"fringe"});
    CHECK(lines->group == std::vector<std::uint32_t>{0, 0});
    const auto strip = read_small_gltf(small_gltf(R"({"mode":3,"attributes":{"POSITION":0}})"));
    REQUIRE(strip);
    REQUIRE(strip->curves.size() == 1);
    CHECK(strip->curves[0].points.size() == 5);
    CHECK(strip->point_radius.empty());
    const auto loop = read_small_gltf(small_gltf(R"({"mode":2,"attributes":{"POSITION":0}})"));
    REQUIRE(loop);
    CHECK(loop->curves.empty());
    CHECK(loop->problems[0].what.find("close to a loop") != std::string::npos);
}

TEST_CASE("a glTF file's buffer is found beside it and named as a dependency") {
    const test::TemporaryFolder folder;
    const std::string buffer = folder.write("hair one.bin", small_gltf_buffer());
    const std::string path =
        folder.write("g.gltf", small_gltf(R"({"mode":3,"attributes":{"POSITION":0}})"));
    const auto groom = read_curves(path);
    if (!groom) FAIL(message_of(groom));
    CHECK(groom->dependencies == std::vector<std::string>{buffer});
    const auto embedded = read_gltf_curves(
        R"({"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":3,"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":2,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":24}],
        "buffers":[{"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAEAAAEBA"}]})",
        "e.gltf", [](const std::string&) -> Result<std::string> { return std::string(); });
    if (!embedded) FAIL(message_of(embedded));
    CHECK(embedded->curves[0].points[1] == Vec3(1, 2, 3));
}

TEST_CASE("glTF indices, accessors, buffers and node trees are checked") {
    const auto refused = [](std::string json, const char* from, const char* to) {
        const std::size_t at = json.find(from);
        REQUIRE(at != std::string::npos);
        json.replace(at, std::strlen(from), to);
        return message_of(read_small_gltf(json));
    };
    const std::string json =
        small_gltf(R"({"mode":1,"attributes":{"POSITION":0,"_WIDTH":1},"indices":2})");
    CHECK(refused(json, "\"count\":5,\"type\":\"VEC3\"", "\"count\":6,\"type\":\"VEC3\"")
              .find("do not fit into its buffer view") != std::string::npos);
    CHECK(refused(json, "\"count\":5,\"type\":\"VEC3\"", "\"count\":4,\"type\":\"VEC3\"")
              .find("1 float for each position") != std::string::npos);
    CHECK(refused(json, "\"byteLength\":60}", "\"byteLength\":93}").find("outside of its buffer") !=
          std::string::npos);
    CHECK(refused(json, "\"children\":[1]", "\"children\":[0]") ==
          "g.gltf: node 0 stands in the scene twice");
    CHECK(refused(json, "\"children\":[1]", "\"children\":[7]") == "g.gltf: node 7 does not exist");
    CHECK(refused(json, "\"scale\":[2,2,2]", "\"scale\":[2,2]").find("fringe") !=
          std::string::npos);
    CHECK(refused(json, "\"POSITION\":0,\"_WIDTH\":1},\"indices\":2",
                  "\"POSITION\":0,\"_WIDTH\":1},\"indices\":9")
              .find("does not exist") != std::string::npos);
    CHECK(message_of(read_small_gltf("{")) ==
          "g.gltf: this is not a glTF file: its JSON cannot be read");
    CHECK(message_of(read_small_gltf("{}")) == "g.gltf: the file has no scene");
}

TEST_CASE("a glTF mesh whose skin would bring the importer down is refused") {
    const test::TemporaryFolder folder;
    const std::string path = folder.write(
        "skin.gltf",
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{}],"skins":[{"joints":[0]}]})");
    const auto mesh = read_mesh(path);
    CHECK(message_of(mesh) == path + ": skin 0 has no inverse bind matrices; export it with them");
}
