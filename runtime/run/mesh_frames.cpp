#include "runtime/run/mesh_frames.h"

#include "schema/file_hash.h"
#include "schema/files/write_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>
#include <unordered_map>

namespace keratin {

namespace {

// Reads words of a line one after the other.
struct Words {
    std::string_view rest;
    std::string_view next() {
        const std::size_t begin = std::min(rest.find_first_not_of(" \t\r"), rest.size());
        const std::size_t end = std::min(rest.find_first_of(" \t\r", begin), rest.size());
        const std::string_view word = rest.substr(begin, end - begin);
        rest.remove_prefix(end);
        return word;
    }
};

// The index, from 0, that an OBJ file writes from 1, or from the end when negative.
bool parse_index(std::string_view word, std::size_t count, std::uint64_t& out) {
    std::int64_t index = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), index);
    if (code != std::errc() || end != word.data() + word.size()) return false;
    if (index < 0) index += static_cast<std::int64_t>(count) + 1;
    out = static_cast<std::uint64_t>(index - 1);
    return index >= 1 && out < count;
}

}  // namespace

Result<ObjTriangles> read_obj_triangles(const std::string& path) {
    auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    ObjTriangles mesh;
    std::vector<std::array<double, 3>> v;
    std::size_t vt_count = 0;
    std::unordered_map<std::uint64_t, std::uint32_t> vertex_of;
    std::vector<std::uint32_t> face;
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        Words words{text.substr(0, end)};
        text.remove_prefix(std::min(end + 1, text.size()));
        const auto fail = [&](const char* message) {
            return Error{ErrorCode::input, path + ":" + std::to_string(line), message};
        };
        const std::string_view kind = words.next();
        if (kind == "v") {
            std::array<double, 3> p{};
            for (double& c : p) {
                const std::string_view word = words.next();
                const auto parsed = std::from_chars(word.data(), word.data() + word.size(), c);
                if (parsed.ec != std::errc() || !std::isfinite(c))
                    return fail("a vertex needs three finite numbers");
            }
            v.push_back(p);
        } else if (kind == "vt") {
            ++vt_count;
        } else if (kind == "f") {
            face.clear();
            for (auto word = words.next(); !word.empty(); word = words.next()) {
                const std::size_t slash = std::min(word.find('/'), word.size());
                std::uint64_t a = 0, b = 0;
                bool ok = parse_index(word.substr(0, slash), v.size(), a);
                std::string_view vt = word.substr(std::min(slash + 1, word.size()));
                vt = vt.substr(0, vt.find('/'));
                if (!vt.empty()) ok = ok && parse_index(vt, vt_count, b);
                if (!ok) return fail("a face names a vertex that is not above it");
                const std::uint64_t key = a << 32 | (vt.empty() ? 0 : b + 1);
                const auto next = static_cast<std::uint32_t>(mesh.position.size());
                const auto [found, is_new] = vertex_of.try_emplace(key, next);
                if (is_new) mesh.position.push_back(v[a]);
                face.push_back(found->second);
            }
            if (face.size() < 3) return fail("a face needs at least three vertices");
            for (std::size_t k = 2; k < face.size(); ++k)
                mesh.triangle.push_back({face[0], face[k - 1], face[k]});
        }
    }
    return mesh;
}

namespace {

std::array<double, 3> to_y_up(const std::array<double, 3>& p, UpAxis up) {
    if (up == UpAxis::x) return {-p[1], p[0], p[2]};
    if (up == UpAxis::z) return {p[0], p[2], -p[1]};
    return p;
}

}  // namespace

template <class Real>
void MeshFrames::at(double t, std::vector<Real>& out) const {
    const auto after = std::upper_bound(time.begin(), time.end(), t);
    const auto hold = [&](const std::vector<float>& frame) {
        out.assign(frame.begin(), frame.end());
    };
    if (after == time.begin()) {
        hold(position.front());
    } else if (after == time.end()) {
        hold(position.back());
    } else {
        const auto b = static_cast<std::size_t>(after - time.begin()), a = b - 1;
        const double share = (t - time[a]) / (time[b] - time[a]);
        out.resize(position[a].size());
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] = static_cast<Real>((1 - share) * position[a][i] + share * position[b][i]);
    }
}
template void MeshFrames::at(double, std::vector<float>&) const;
template void MeshFrames::at(double, std::vector<double>&) const;

Result<MeshFrames> read_mesh_frames(const SceneAsset& asset, const AssetInfo& info) {
    MeshFrames out;
    for (const MeshFrame& frame : asset.mesh_frames) {
        auto mesh = read_obj_triangles(frame.file);
        if (!mesh) return mesh.error();
        if (hash_bytes(std::as_bytes(std::span(mesh->triangle))) != info.mesh_topology_hash)
            return Error{ErrorCode::input, frame.file,
                         "its " + std::to_string(mesh->triangle.size()) +
                             " triangles are not those of the mesh that " + asset.file +
                             " was bound to (" + std::to_string(info.mesh_triangle_count) +
                             " triangles); a mesh frame differs in the positions of vertices only"};
        std::vector<float> position;
        position.reserve(3 * mesh->position.size());
        for (const auto& p : mesh->position)
            for (const double c : to_y_up(p, asset.mesh_up_axis))
                position.push_back(static_cast<float>(c * asset.mesh_scale));
        out.time.push_back(frame.time);
        out.position.push_back(std::move(position));
    }
    return out;
}

}  // namespace keratin
