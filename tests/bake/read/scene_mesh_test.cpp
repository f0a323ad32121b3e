#include "bake/read/read_mesh.h"
#include "tests/bake/read/make_bytes.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>

#include <cstdint>
#include <filesystem>
#include <limits>

using namespace keratin;

namespace {

// A unit square of two triangles in the plane z = 0: positions, then u16 indices.
std::string square_buffer(float last_x) {
    std::string bytes;
    for (float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, last_x, 1.f, 0.f, 0.f, 1.f, 0.f})
        test::append(bytes, value);
    for (std::uint16_t index : {0, 1, 2, 0, 2, 3}) test::append(bytes, index);
    return bytes;
}

std::string square_gltf(const std::string& nodes) {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
           R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                     {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
        "buffers":[{"uri":"square.bin","byteLength":60}]})";
}

}  // namespace

TEST_CASE("a glTF mesh stands where its node puts it and names its buffer as a dependency") {
    const test::TemporaryFolder folder;
    const std::string buffer = folder.write("square.bin", square_buffer(1));
    const std::string path = folder.write(
        "square.gltf",
        square_gltf(R"([{"name":"patch","mesh":0,"translation":[0,2,0],"scale":[3,3,3]}])"));
    const auto mesh = read_mesh(path);
    REQUIRE(mesh);
    REQUIRE(mesh->position.size() == 4);
    CHECK((mesh->position[2] - Vec3(3, 5, 0)).norm() < 1e-6);
    CHECK(mesh->triangle == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}});
    REQUIRE(mesh->parts.size() == 1);
    CHECK(mesh->parts[0].name == "patch");
    CHECK(!mesh->skin);
    REQUIRE(mesh->dependencies.size() == 1);
    CHECK(std::filesystem::equivalent(mesh->dependencies[0], buffer));
}

TEST_CASE("a mesh vertex that is not finite is refused by name") {
    const test::TemporaryFolder folder;
    folder.write("square.bin", square_buffer(std::numeric_limits<float>::quiet_NaN()));
    const std::string path =
        folder.write("square.gltf", square_gltf(R"([{"name":"patch","mesh":0}])"));
    const auto mesh = read_mesh(path);
    REQUIRE(!mesh);
    CHECK(mesh.error().code == ErrorCode::input);
    CHECK(to_string(mesh.error()) ==
          path + ": part \"patch\": vertex 2 is not finite or is immensely far away");
}

TEST_CASE("a skinned glTF mesh brings its bones and weights") {
    std::string buffer = square_buffer(1);
    for (int vertex = 0; vertex < 4; ++vertex)
        for (std::uint8_t joint : {0, 1, 0, 0}) test::append(buffer, joint);
    for (int vertex = 0; vertex < 4; ++vertex)
        for (float weight : {0.25f, 0.75f, 0.f, 0.f}) test::append(buffer, weight);
    for (int joint = 0; joint < 2; ++joint)  // inverse bind matrices
        for (int entry = 0; entry < 16; ++entry) test::append(buffer, entry % 5 == 0 ? 1.f : 0.f);
    const test::TemporaryFolder folder;
    folder.write("skin.bin", buffer);
    const std::string path =
        folder.write("skin.gltf",
                     R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
        "nodes":[{"name":"patch","mesh":0,"skin":0},{"name":"neck","children":[2]},{"name":"head"}],
        "skins":[{"joints":[1,2],"inverseBindMatrices":4}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                     {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},
                     {"bufferView":2,"componentType":5121,"count":4,"type":"VEC4"},
                     {"bufferView":3,"componentType":5126,"count":4,"type":"VEC4"},
                     {"bufferView":4,"componentType":5126,"count":2,"type":"MAT4"}],
        "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12},
                       {"buffer":0,"byteOffset":60,"byteLength":16},{"buffer":0,"byteOffset":76,"byteLength":64},
                       {"buffer":0,"byteOffset":140,"byteLength":128}],
        "buffers":[{"uri":"skin.bin","byteLength":268}]})");
    const auto mesh = read_mesh(path);
    REQUIRE(mesh);
    REQUIRE(mesh->skin);
    CHECK(mesh->skin->bones == std::vector<std::string>{"neck", "head"});
    REQUIRE(mesh->skin->weight.size() == 4);
    CHECK(mesh->skin->weight[0][0] == 0.75);
    CHECK(mesh->skin->bone[0][0] == 1);
    CHECK(mesh->skin->weight[0][1] == 0.25);
    CHECK(mesh->skin->bone[0][1] == 0);
    CHECK((mesh->position[2] - Vec3(1, 1, 0)).norm() < 1e-6);
}

TEST_CASE("a missing, a damaged and a pointless mesh file are refused") {
    const auto missing = read_mesh("nowhere.fbx");
    REQUIRE(!missing);
    CHECK(missing.error().code == ErrorCode::io);
    const test::TemporaryFolder folder;
    const auto damaged = read_mesh(folder.write("damaged.glb", "glTF no more"));
    REQUIRE(!damaged);
    CHECK(damaged.error().code == ErrorCode::input);
    const auto points = read_mesh(
        folder.write("points.ply",
                     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                     "property float z\nend_header\n0 0 0\n"));
    REQUIRE(!points);
    CHECK(points.error().code == ErrorCode::input);
}

TEST_CASE("an FBX mesh is read with its triangles") {
    const test::TemporaryFolder folder;
    const std::string path = folder.write("square.fbx", R"(; FBX 7.4.0 project file
FBXHeaderExtension:  {
	FBXHeaderVersion: 1003
	FBXVersion: 7400
}
GlobalSettings:  {
	Version: 1000
	Properties70:  {
		P: "UpAxis", "int", "Integer", "",1
		P: "UpAxisSign", "int", "Integer", "",1
		P: "FrontAxis", "int", "Integer", "",2
		P: "FrontAxisSign", "int", "Integer", "",1
		P: "CoordAxis", "int", "Integer", "",0
		P: "CoordAxisSign", "int", "Integer", "",1
		P: "UnitScaleFactor", "double", "Number", "",1
	}
}
Objects:  {
	Geometry: 10, "Geometry::", "Mesh" {
		Vertices: *12 {
			a: 0,0,0,1,0,0,1,1,0,0,1,0
		}
		PolygonVertexIndex: *4 {
			a: 0,1,2,-4
		}
		GeometryVersion: 124
	}
	Model: 20, "Model::patch", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",0,5,0
		}
	}
}
Connections:  {
	C: "OO",20,0
	C: "OO",10,20
}
)");
    const auto mesh = read_mesh(path);
    if (!mesh) FAIL(to_string(mesh.error()));
    CHECK(mesh->triangle.size() == 2);
    REQUIRE(mesh->parts.size() == 1);
    CHECK(mesh->parts[0].name == "patch");
    CHECK((mesh->position[mesh->triangle[1][1]] - Vec3(1, 6, 0)).norm() < 1e-6);
}
