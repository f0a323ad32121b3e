#include "bake/read/formats.h"
#include "bake/read/read_mesh.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace keratin;

namespace {

const std::string kData = KERATIN_DATA_DIR;

std::string message_of(const std::string& text) {
    const auto mesh = read_obj_mesh(text, "m.obj");
    REQUIRE(!mesh);
    CHECK(mesh.error().code == ErrorCode::input);
    return to_string(mesh.error());
}

}  // namespace

TEST_CASE("the ponytail head keeps its ten parts and its triangles") {
    const auto mesh = read_mesh(kData + "/tressfx/ponytail.obj");
    REQUIRE(mesh);
    CHECK(mesh->triangle.size() == 17894);
    CHECK(mesh->uv.size() == mesh->position.size());
    REQUIRE(mesh->parts.size() == 10);
    CHECK(mesh->parts[2].name == "Mesh_head");
    std::uint32_t next = 0;
    for (const RawMeshPart& part : mesh->parts) {
        CHECK(part.first_triangle == next);
        CHECK(part.triangle_count > 0);
        next += part.triangle_count;
    }
    CHECK(next == mesh->triangle.size());
    for (const auto& triangle : mesh->triangle)
        for (std::uint32_t vertex : triangle) REQUIRE(vertex < mesh->position.size());
}

TEST_CASE("expressions of one face have the same vertices and triangles") {
    const auto neutral = read_mesh(kData + "/ict/ict_generic_neutral_mesh.obj");
    REQUIRE(neutral);
    CHECK(neutral->triangle.size() == 52220);
    CHECK(std::any_of(neutral->parts.begin(), neutral->parts.end(),
                      [](const RawMeshPart& part) { return part.name == "M_Face"; }));
    for (const char* name : {"jawOpen", "mouthSmile_L", "browInnerUp_L"}) {
        INFO(name);
        const auto posed = read_mesh(kData + "/ict/ict_" + name + ".obj");
        REQUIRE(posed);
        CHECK(posed->triangle == neutral->triangle);
        CHECK(posed->uv == neutral->uv);
        REQUIRE(posed->position.size() == neutral->position.size());
        CHECK(posed->position != neutral->position);
    }
}

TEST_CASE("every mesh in data has the triangles of its file") {
    const std::pair<const char*, std::size_t> files[] = {{"/tressfx/bear.obj", 57784},
                                                         {"/spot/spot.obj", 5856}};
    for (const auto& [name, triangles] : files) {
        const auto mesh = read_mesh(kData + name);
        REQUIRE(mesh);
        CHECK(mesh->triangle.size() == triangles);
    }
}

TEST_CASE("a polygon becomes a fan and a vertex is a pair of position and texture coordinate") {
    const auto mesh = read_obj_mesh(
        "mtllib none.mtl\nv 0 0 0\nv 1 0 0 # corner\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\n"
        "o patch\nf 1/1 2/1 3/2 \\\n 4/2\nf -4/1 -3/1 -2/1\n",
        "m.obj");
    REQUIRE(mesh);
    CHECK(mesh->triangle ==
          std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 1, 4}});
    CHECK(mesh->position[4] == Vec3(1, 1, 0));
    CHECK(mesh->uv[2] == Vec2(1, 1));
    CHECK(mesh->uv[4] == Vec2(0, 0));
    REQUIRE(mesh->parts.size() == 1);
    CHECK(mesh->parts[0].name == "patch");
    CHECK(mesh->dependencies == std::vector<std::string>{"none.mtl"});
}

TEST_CASE("a faulty OBJ mesh is refused at its line and column") {
    CHECK(message_of("v 0 0 0\nv 1,5 0 0\n") == "m.obj:2:3: \"1,5\" is not a number");
    CHECK(message_of("v 0 0 0\nv nan 0 0\n") ==
          "m.obj:2:1: the position is not finite or is immensely far away");
    CHECK(message_of("v 0 0\n") == "m.obj:1:1: \"v\" needs 3 numbers");
    CHECK(message_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n") ==
          "m.obj:4:7: the vertex is out of range; 3 vertices stand above it in the face corner "
          "\"4\"");
    CHECK(message_of("v 0 0 0\nv 1 0 0\nf 1 2\n") == "m.obj:3:1: a face needs 3 corners or more");
    CHECK(message_of("v 0 0 0\nv 1 0 0\nv 1 1 0\n") == "m.obj: the mesh has no triangles");
    const auto missing = read_mesh("nowhere.obj");
    REQUIRE(!missing);
    CHECK(missing.error().code == ErrorCode::io);
    CHECK(to_string(missing.error()) == "nowhere.obj: cannot open: No such file or directory");
}
