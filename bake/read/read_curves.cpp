#include "bake/read/read_curves.h"

#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace keratin {
namespace {

std::string ending_of(const std::string& path) {
    std::string ending = std::filesystem::path(path).extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending;
}

Result<RawGroom> read_by_ending(const std::string& path, std::string_view bytes) {
    const std::string ending = ending_of(path);
    if (ending == ".tfx") return read_tfx(bytes, path);
    if (ending == ".obj") return read_obj_curves(bytes, path);
    return Error{ErrorCode::unsupported, path,
                 ending.empty()
                     ? "the name has no ending that tells the format (known: .tfx, .obj)"
                     : '"' + ending + "\" is not a known format of curves (known: .tfx, .obj)"};
}

}  // namespace

Result<RawGroom> read_curves(const std::string& path) {
    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    auto groom = read_by_ending(path, text_of(*mapped));
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

}  // namespace keratin
