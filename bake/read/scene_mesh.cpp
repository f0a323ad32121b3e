#include "bake/read/scene_mesh.h"

#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <Eigen/Geometry>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/scene.h>

#include <algorithm>
#include <map>

namespace keratin {
namespace {

using Placement = Eigen::Matrix4d;

// Remembers which files the importer opened.
class RecordingFiles : public Assimp::DefaultIOSystem {
  public:
    explicit RecordingFiles(std::vector<std::string>& opened) : opened_(opened) {}
    Assimp::IOStream* Open(const char* path, const char* mode) override {
        Assimp::IOStream* stream = DefaultIOSystem::Open(path, mode);
        if (stream) opened_.push_back(path);
        return stream;
    }

  private:
    std::vector<std::string>& opened_;
};

Placement to_eigen(const aiMatrix4x4& m) {
    Placement out;
    out << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3,
        m.d4;
    return out;
}

Placement world_of(const aiNode* node) {
    Placement world = Placement::Identity();
    for (; node; node = node->mParent) world = to_eigen(node->mTransformation) * world;
    return world;
}

Vec3 transformed(const Placement& placement, const aiVector3D& v) {
    const Eigen::Vector4d point = placement * Eigen::Vector4d(v.x, v.y, v.z, 1);
    return point.head<3>();
}

struct Reading {
    const aiScene* scene = nullptr;
    RawMesh mesh;
    RawSkin skin;  // grows with the mesh; unused slots have weight 0
    std::map<std::string, std::uint32_t> bone_of;
    bool has_skin = false, has_uv = false;
};

// Keeps the four heaviest weights of a vertex, heaviest first.
void add_weight(RawSkin& skin, std::size_t vertex, std::uint32_t bone, double weight) {
    for (std::size_t k = 0; k < 4; ++k) {
        if (weight <= skin.weight[vertex][k]) continue;
        std::swap(skin.weight[vertex][k], weight);
        std::swap(skin.bone[vertex][k], bone);
    }
}

Result<void> add_part(Reading& reading, const aiNode* node, const aiMesh& part,
                      const std::string& file) {
    RawMesh& mesh = reading.mesh;
    std::string name = node->mName.C_Str();
    if (name.empty()) name = part.mName.C_Str();
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file + ": part \"" + name + '"', what};
    };
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const auto base = static_cast<std::uint32_t>(mesh.position.size());
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
        const aiFace& face = part.mFaces[f];
        if (face.mNumIndices < 3) continue;  // points and lines
        for (unsigned k = 0; k < face.mNumIndices; ++k)
            if (face.mIndices[k] >= part.mNumVertices)
                return damaged("face " + std::to_string(f) + ": vertex " +
                               std::to_string(face.mIndices[k]) + " is out of range (" +
                               std::to_string(part.mNumVertices) + " vertices)");
        for (unsigned k = 2; k < face.mNumIndices; ++k)
            triangles.push_back(
                {base + face.mIndices[0], base + face.mIndices[k - 1], base + face.mIndices[k]});
    }
    if (triangles.empty()) return {};

    const std::size_t end = base + std::size_t{part.mNumVertices};
    const Placement world = world_of(node);
    mesh.position.resize(end);
    mesh.uv.resize(end, Vec2::Zero());
    reading.skin.bone.resize(end, {0, 0, 0, 0});
    reading.skin.weight.resize(end, {0, 0, 0, 0});
    std::vector<Vec3> posed(part.mNumVertices, Vec3::Zero());
    std::vector<double> total(part.mNumVertices, 0);
    for (unsigned b = 0; b < part.mNumBones; ++b) {
        const aiBone& bone = *part.mBones[b];
        const auto [slot, is_new] = reading.bone_of.try_emplace(
            bone.mName.C_Str(), static_cast<std::uint32_t>(reading.skin.bones.size()));
        if (is_new) reading.skin.bones.emplace_back(bone.mName.C_Str());
        const aiNode* joint = reading.scene->mRootNode->FindNode(bone.mName);
        const Placement placement =
            joint ? Placement(world_of(joint) * to_eigen(bone.mOffsetMatrix)) : world;
        for (unsigned w = 0; w < bone.mNumWeights; ++w) {
            const aiVertexWeight& entry = bone.mWeights[w];
            if (entry.mVertexId >= part.mNumVertices)
                return damaged("bone \"" + std::string(bone.mName.C_Str()) +
                               "\" names a vertex that is out of range");
            if (!(entry.mWeight > 0)) continue;
            const double weight = entry.mWeight;
            add_weight(reading.skin, base + entry.mVertexId, slot->second, weight);
            posed[entry.mVertexId] +=
                weight * transformed(placement, part.mVertices[entry.mVertexId]);
            total[entry.mVertexId] += weight;
            reading.has_skin = true;
        }
    }
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
        const Vec3 position =
            total[v] > 0 ? Vec3(posed[v] / total[v]) : transformed(world, part.mVertices[v]);
        if (!is_usable(position))
            return damaged("vertex " + std::to_string(v) +
                           " is not finite or is immensely far away");
        mesh.position[base + v] = position;
        if (!part.mTextureCoords[0]) continue;
        const aiVector3D& uv = part.mTextureCoords[0][v];
        mesh.uv[base + v] = Vec2(uv.x, uv.y);
        if (!mesh.uv[base + v].allFinite())
            return damaged("the texture coordinate of vertex " + std::to_string(v) +
                           " is not finite");
        reading.has_uv = true;
    }
    mesh.parts.push_back({name, static_cast<std::uint32_t>(mesh.triangle.size()),
                          static_cast<std::uint32_t>(triangles.size())});
    mesh.triangle.insert(mesh.triangle.end(), triangles.begin(), triangles.end());
    return {};
}

Result<void> add_nodes(Reading& reading, const aiNode* node, const std::string& file) {
    for (unsigned m = 0; m < node->mNumMeshes; ++m) {
        auto added = add_part(reading, node, *reading.scene->mMeshes[node->mMeshes[m]], file);
        if (!added) return added;
    }
    for (unsigned c = 0; c < node->mNumChildren; ++c) {
        auto added = add_nodes(reading, node->mChildren[c], file);
        if (!added) return added;
    }
    return {};
}

}  // namespace

Result<RawMesh> read_scene_mesh(const std::string& path) {
    {
        // Assimp's own text for a missing or unreadable file says less.
        const auto mapped = MappedFile::open(path);
        if (!mapped) return mapped.error();
        const std::string_view bytes = text_of(*mapped);
        const bool is_gltf = bytes.starts_with("glTF") || path.ends_with(".gltf");
        if (is_gltf)
            if (const auto fault = find_gltf_mesh_fault(bytes, path)) return *fault;
    }
    std::vector<std::string> opened;
    Assimp::Importer importer;
    importer.SetIOHandler(new RecordingFiles(opened));  // owned by the importer
    importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
    // No post-processing: joining vertices and cutting polygons look at positions, so that two
    // poses of one mesh would get different numbers.
    Reading reading;
    reading.scene = importer.ReadFile(path, 0);
    if (!reading.scene || !reading.scene->mRootNode) {
        std::string what = importer.GetErrorString();
        while (!what.empty() && (what.back() == '.' || what.back() == '\n')) what.pop_back();
        return Error{ErrorCode::input, path, "the mesh cannot be read: " + what};
    }
    reading.mesh.file = path;
    if (auto added = add_nodes(reading, reading.scene->mRootNode, path); !added)
        return added.error();
    RawMesh& mesh = reading.mesh;
    if (mesh.triangle.empty()) return Error{ErrorCode::input, path, "the mesh has no triangles"};
    if (!reading.has_uv) mesh.uv.clear();
    if (reading.has_skin) mesh.skin = std::move(reading.skin);
    std::sort(opened.begin(), opened.end());
    opened.erase(std::unique(opened.begin(), opened.end()), opened.end());
    for (const std::string& file : opened)
        if (file != path) mesh.dependencies.push_back(file);
    return std::move(mesh);
}

}  // namespace keratin
