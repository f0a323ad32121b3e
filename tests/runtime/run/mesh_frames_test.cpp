#include "runtime/run/mesh_frames.h"

#include "schema/file_hash.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <unistd.h>

using namespace keratin;

namespace {

struct ObjFile {
    std::string path = (std::filesystem::temp_directory_path() /
                        ("keratin_mesh_frames_" + std::to_string(::getpid()) + ".obj"))
                           .string();
    explicit ObjFile(const std::string& text) { std::ofstream(path, std::ios::trunc) << text; }
    ~ObjFile() { std::filesystem::remove(path); }
};

// Two triangles of a quad; vertices numbered by first use: file vertices 3, 1, 2, 4.
AssetInfo quad_info() {
    const std::array<std::uint32_t, 6> triangles{0, 1, 2, 0, 2, 3};
    AssetInfo info;
    info.mesh_topology_hash = hash_bytes(std::as_bytes(std::span(triangles)));
    info.mesh_triangle_count = 2;
    return info;
}

std::string failure(const std::string& text) {
    const ObjFile file(text);
    SceneAsset asset;
    asset.file = "a.kera";
    asset.mesh_frames = {{0, file.path}};
    auto frames = read_mesh_frames(asset, quad_info());
    return frames ? "accepted"
                  : frames.error().where.substr(file.path.size()) + " " + frames.error().message;
}

}  // namespace

TEST_CASE("mesh frames are read in the bake's order of vertices, scaled and turned up") {
    const ObjFile file("v 1 2 3\nv 4 5 6\nv 7 8 9\nv 10 11 12\n# x\nf 3 1/ 2 -1\n");
    SceneAsset asset;
    asset.mesh_scale = 0.5;
    asset.mesh_frames = {{0, file.path}};
    auto frames = read_mesh_frames(asset, quad_info());
    INFO((frames ? "" : to_string(frames.error())));
    REQUIRE(frames);
    CHECK(frames->position[0] ==
          std::vector<float>{3.5f, 4, 4.5f, 0.5f, 1, 1.5f, 2, 2.5f, 3, 5, 5.5f, 6});
    asset.mesh_up_axis = UpAxis::z;
    frames = read_mesh_frames(asset, quad_info());
    REQUIRE(frames);
    CHECK(frames->position[0][0] == 3.5f);
    CHECK(frames->position[0][1] == 4.5f);
    CHECK(frames->position[0][2] == -4);
}

TEST_CASE("between mesh frames vertices move evenly, outside they are held") {
    const MeshFrames frames{{1, 2}, {{0, 0, 0}, {2, 4, 8}}};
    std::vector<float> out;
    frames.at(1.25, out);
    CHECK(out == std::vector<float>{0.5f, 1, 2});
    frames.at(0, out);
    CHECK(out == std::vector<float>{0, 0, 0});
    frames.at(5, out);
    CHECK(out == std::vector<float>{2, 4, 8});
}

TEST_CASE("a mesh frame that is broken or another mesh is refused with its place") {
    CHECK(failure("v 1 2\n") == ":1 a vertex needs three finite numbers");
    CHECK(failure("v 1 2 nan\n") == ":1 a vertex needs three finite numbers");
    CHECK(failure("v 1 2 3\nf 1 2 3\n") == ":2 a face names a vertex that is not above it");
    CHECK(failure("v 1 2 3\nf 1 1\n") == ":2 a face needs at least three vertices");
    CHECK(failure("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("its 1 triangles are not those") !=
          std::string::npos);
}
