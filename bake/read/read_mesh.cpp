#include "bake/read/read_mesh.h"

#include "bake/read/bytes.h"
#include "bake/read/formats.h"
#include "bake/read/scene_mesh.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace keratin {

Result<RawMesh> read_mesh(const std::string& path) {
    const std::filesystem::path where(path);
    std::string ending = where.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending != ".obj") return read_scene_mesh(path);
    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    auto mesh = read_obj_mesh(text_of(*mapped), path);
    if (!mesh) return mesh;
    // Build tools are to hear of the material libraries that are really there.
    std::vector<std::string> present;
    for (const std::string& library : mesh->dependencies) {
        const auto beside = where.parent_path() / library;
        std::error_code code;
        if (std::filesystem::is_regular_file(beside, code)) present.push_back(beside.string());
    }
    mesh->dependencies = std::move(present);
    return mesh;
}

}  // namespace keratin
