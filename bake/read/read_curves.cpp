#include "bake/read/read_curves.h"

#include "bake/read/bytes.h"
#include "bake/read/formats.h"
#include "bake/read/occt/iges_step.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>

namespace keratin {
namespace {

// "a%20b.bin" is "a b.bin".
std::string decode_uri(std::string_view uri) {
    std::string path;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        unsigned value = 0;
        if (uri[i] == '%' && i + 2 < uri.size() &&
            std::from_chars(&uri[i + 1], &uri[i + 1] + 2, value, 16).ptr == &uri[i + 1] + 2) {
            path += static_cast<char>(value);
            i += 2;
        } else {
            path += uri[i];
        }
    }
    return path;
}

std::string ending_of(const std::string& path) {
    std::string ending = std::filesystem::path(path).extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending;
}

constexpr std::string_view kKnown =
    "known: .tfx, .obj, .hair, .data, .gltf, .glb, .abc, .iges, .igs, .step, .stp";

// Reads the buffers that lie beside a glTF file, and notes them.
Result<RawGroom> read_gltf_beside(std::string_view bytes, const std::string& path) {
    std::vector<std::string> dependencies;
    const auto open_buffer = [&](const std::string& uri) -> Result<std::string> {
        const auto beside = std::filesystem::path(path).parent_path() / decode_uri(uri);
        auto mapped = MappedFile::open(beside.string());
        if (!mapped) return mapped.error();
        dependencies.push_back(beside.string());
        return std::string(text_of(*mapped));
    };
    auto groom = read_gltf_curves(bytes, path, open_buffer);
    if (groom) groom->dependencies = std::move(dependencies);
    return groom;
}

Result<RawGroom> read_cad(const std::string& path, [[maybe_unused]] CadFormat format) {
#ifdef KERATIN_WITH_OCCT
    return read_cad_curves(path, format);
#else
    return Error{ErrorCode::unsupported, path,
                 "IGES and STEP are read only by builds with KERATIN_WITH_OCCT"};
#endif
}

// What a file's first bytes say goes before its ending.
Result<RawGroom> read_by_kind(const std::string& path, std::string_view bytes, double time) {
    const std::string ending = ending_of(path);
    if (bytes.starts_with("Ogawa") || ending == ".abc") return read_alembic(bytes, path, time);
    if (bytes.starts_with("HAIR")) return read_hair(bytes, path);
    if (bytes.starts_with("glTF") || ending == ".gltf") return read_gltf_beside(bytes, path);
    if (ending == ".tfx") return read_tfx(bytes, path);
    if (ending == ".obj") return read_obj_curves(bytes, path);
    if (ending == ".data") return read_usc_data(bytes, path);
    if (ending == ".hair") return read_hair(bytes, path);
    if (ending == ".igs" || ending == ".iges") return read_cad(path, CadFormat::iges);
    if (ending == ".stp" || ending == ".step") return read_cad(path, CadFormat::step);
    std::string what = ending.empty() ? "the name has no ending that tells the format"
                                      : '"' + ending + "\" is not a known format of curves";
    return Error{ErrorCode::unsupported, path, what + " (" + std::string(kKnown) + ')'};
}

}  // namespace

Result<RawGroom> read_curves(const std::string& path, double time) {
    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    auto groom = read_by_kind(path, text_of(*mapped), time);
    if (!groom || !groom->curves.empty()) return groom;
    if (groom->problems.empty()) return Error{ErrorCode::input, path, "the file holds no curves"};
    const CurveProblem& first = groom->problems.front();
    std::string where = path;
    if (first.line > 0) where += ':' + std::to_string(first.line);
    return Error{ErrorCode::input, where + ": curve " + std::to_string(first.curve),
                 first.what + "; the file holds no usable curve"};
}

Result<RawSkin> read_skin(const std::string& path) {
    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    return read_tfxbone(text_of(*mapped), path);
}

Result<RawBinding> read_binding(const std::string& path) {
    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    return read_tfxskin(text_of(*mapped), path);
}

}  // namespace keratin
