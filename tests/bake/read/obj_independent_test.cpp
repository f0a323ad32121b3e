// Our OBJ readers against tinyobjloader, which shares nothing with them.
#include "bake/read/read_curves.h"
#include "bake/read/read_mesh.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <tiny_obj_loader.h>

using namespace keratin;

namespace {

tinyobj::ObjReader load(const std::string& name) {
    tinyobj::ObjReaderConfig config;
    config.triangulate = false;
    tinyobj::ObjReader reader;
    REQUIRE(reader.ParseFromFile(KERATIN_DATA_DIR + name, config));
    return reader;
}

Vec3 position(const tinyobj::ObjReader& reader, int vertex) {
    const auto& v = reader.GetAttrib().vertices;
    const auto at = static_cast<std::size_t>(3 * vertex);
    return {v[at], v[at + 1], v[at + 2]};
}

}  // namespace

TEST_CASE("polylines equal those that tinyobjloader reads") {
    const std::string name = "/ponytail_formats/ponytail_tail.lines.obj";
    const auto groom = read_curves(KERATIN_DATA_DIR + name);
    REQUIRE(groom);
    const auto reader = load(name);
    REQUIRE(reader.GetShapes().size() == 1);
    const auto& lines = reader.GetShapes()[0].lines;
    REQUIRE(lines.num_line_vertices.size() == groom->curves.size());
    std::size_t at = 0;
    for (std::size_t s = 0; s < groom->curves.size(); ++s) {
        const auto& points = groom->curves[s].points;
        REQUIRE(static_cast<std::size_t>(lines.num_line_vertices[s]) == points.size());
        // tinyobjloader keeps single precision.
        for (const Vec3& point : points)
            CHECK((position(reader, lines.indices[at++].vertex_index) - point).norm() <
                  1e-6 * point.norm());
    }
}

TEST_CASE("mesh corners equal those that tinyobjloader reads") {
    const std::string name = "/tressfx/ponytail.obj";
    const auto mesh = read_mesh(KERATIN_DATA_DIR + name);
    REQUIRE(mesh);
    const auto reader = load(name);
    REQUIRE(reader.GetShapes().size() == mesh->parts.size());
    std::size_t triangle = 0;
    for (std::size_t part = 0; part < mesh->parts.size(); ++part) {
        const auto& shape = reader.GetShapes()[part];
        CHECK(shape.name == mesh->parts[part].name);
        REQUIRE(shape.mesh.num_face_vertices.size() == mesh->parts[part].triangle_count);
        for (std::size_t f = 0; f < shape.mesh.num_face_vertices.size(); ++f, ++triangle) {
            REQUIRE(shape.mesh.num_face_vertices[f] == 3);
            for (std::size_t k = 0; k < 3; ++k) {
                const auto& index = shape.mesh.indices[3 * f + k];
                const std::uint32_t vertex = mesh->triangle[triangle][k];
                const auto& uv = reader.GetAttrib().texcoords;
                const auto at = static_cast<std::size_t>(2 * index.texcoord_index);
                REQUIRE((position(reader, index.vertex_index) - mesh->position[vertex]).norm() <
                        1e-5);
                REQUIRE((Vec2(uv[at], uv[at + 1]) - mesh->uv[vertex]).norm() < 1e-6);
            }
        }
    }
    CHECK(triangle == mesh->triangle.size());
}
