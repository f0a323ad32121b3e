#include "bake/read/formats.h"
#include "bake/read/obj_text.h"

#include <string>
#include <unordered_map>

namespace keratin {
namespace {

// What is collected while the statements pass.
struct ObjMesh {
    std::vector<Vec3> v;
    std::vector<Vec2> vt;
    std::unordered_map<std::uint64_t, std::uint32_t> vertex_of;  // pair (v, vt + 1) to vertex
    std::vector<std::uint32_t> face;                             // corners of the current polygon
    std::string object, material;
    bool has_object = false, uses_vt = false;
    RawMesh mesh;
};

constexpr std::size_t kMaxVertices = 0xfffffff0;

std::string describe_range(std::size_t count, const char* what) {
    return "; " + std::to_string(count) + ' ' + what + (count == 1 ? " stands" : " stand") +
           " above it";
}

// The vertex of a corner "v", "v/vt", "v//vn" or "v/vt/vn".
Result<std::uint32_t> corner(ObjMesh& obj, std::string_view word, std::string_view text,
                             const std::string& file) {
    const auto wrong = [&](const std::string& what) {
        return Error{ErrorCode::input, place_of(word, text, file),
                     what + " in the face corner \"" + std::string(word) + '"'};
    };
    const std::size_t slash = word.find('/');
    const std::string_view v_word = word.substr(0, slash);
    std::string_view vt_word;
    if (slash != std::string_view::npos) {
        vt_word = word.substr(slash + 1);
        vt_word = vt_word.substr(0, vt_word.find('/'));
    }
    const auto v_index = parse_integer(v_word);
    if (!v_index) return wrong("a number is missing");
    const auto v = resolve_index(*v_index, obj.v.size());
    if (!v) return wrong("the vertex is out of range" + describe_range(obj.v.size(), "vertices"));
    std::uint64_t key = static_cast<std::uint64_t>(*v) << 32;
    Vec2 uv = Vec2::Zero();
    if (!vt_word.empty()) {
        const auto vt_index = parse_integer(vt_word);
        if (!vt_index) return wrong("a number is missing");
        const auto vt = resolve_index(*vt_index, obj.vt.size());
        if (!vt)
            return wrong("the texture coordinate is out of range" +
                         describe_range(obj.vt.size(), "texture coordinates"));
        key |= *vt + 1;
        uv = obj.vt[*vt];
        obj.uses_vt = true;
    }
    const auto [found, is_new] =
        obj.vertex_of.try_emplace(key, static_cast<std::uint32_t>(obj.mesh.position.size()));
    if (is_new) {
        obj.mesh.position.push_back(obj.v[*v]);
        obj.mesh.uv.push_back(uv);
    }
    return found->second;
}

void add_triangles(ObjMesh& obj) {
    RawMesh& mesh = obj.mesh;
    const std::string& name = obj.has_object ? obj.object : obj.material;
    if (mesh.parts.empty() || mesh.parts.back().name != name)
        mesh.parts.push_back({name, static_cast<std::uint32_t>(mesh.triangle.size()), 0});
    for (std::size_t k = 2; k < obj.face.size(); ++k) {
        mesh.triangle.push_back({obj.face[0], obj.face[k - 1], obj.face[k]});
        ++mesh.parts.back().triangle_count;
    }
}

}  // namespace

Result<RawMesh> read_obj_mesh(std::string_view text, const std::string& file) {
    ObjMesh obj;
    obj.mesh.file = file;
    ObjStatements statements(text);
    ObjStatement statement;
    while (statements.next(statement)) {
        const std::string_view name = statement.words[0];
        if (name == "v") {
            Vec3 position;
            if (auto read = read_numbers(statement, text, file, 3, {position.data(), 3}); !read)
                return read.error();
            if (!is_usable(position))
                return Error{ErrorCode::input, place_of(name, text, file),
                             "the position is not finite or is immensely far away"};
            if (obj.v.size() >= kMaxVertices)
                return Error{ErrorCode::input, place_of(name, text, file), "too many vertices"};
            obj.v.push_back(position);
        } else if (name == "vt") {
            Vec2 uv;
            if (auto read = read_numbers(statement, text, file, 1, {uv.data(), 2}); !read)
                return read.error();
            if (!uv.allFinite())
                return Error{ErrorCode::input, place_of(name, text, file),
                             "the texture coordinate is not finite"};
            obj.vt.push_back(uv);
        } else if (name == "f") {
            if (statement.words.size() < 4)
                return Error{ErrorCode::input, place_of(name, text, file),
                             "a face needs 3 corners or more"};
            obj.face.clear();
            for (std::size_t i = 1; i < statement.words.size(); ++i) {
                const auto vertex = corner(obj, statement.words[i], text, file);
                if (!vertex) return vertex.error();
                obj.face.push_back(*vertex);
            }
            add_triangles(obj);
        } else if (name == "o" || name == "g") {
            obj.object = join_words(statement, 1);
            obj.has_object = true;
        } else if (name == "usemtl") {
            obj.material = join_words(statement, 1);
        } else if (name == "mtllib") {
            obj.mesh.dependencies.push_back(join_words(statement, 1));
        }
    }
    if (obj.mesh.triangle.empty())
        return Error{ErrorCode::input, file, "the mesh has no triangles"};
    if (!obj.uses_vt) obj.mesh.uv.clear();
    return std::move(obj.mesh);
}

}  // namespace keratin
