#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <cmath>
#include <cstdint>
#include <string>

namespace keratin {

// i32 bones; bones x { i32 index; i32 length with the final NUL; char name[length] };
// i32 strands; strands x { i32 strand; 4 x { i32 place in the list above; f32 weight } }.
Result<RawSkin> read_tfxbone(std::string_view bytes, const std::string& file) {
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file, what};
    };
    constexpr std::size_t kStrandSize = 4 + 4 * 8;
    if (bytes.size() < 8) return damaged("the file ends inside its header; it is cut");
    const auto bone_count = load<std::int32_t>(bytes, 0);
    std::size_t offset = 4;
    if (bone_count <= 0 || !holds(bytes, offset, static_cast<std::uint64_t>(bone_count), 8))
        return damaged("the number of bones, " + std::to_string(bone_count) +
                       ", does not fit the size of the file");
    RawSkin skin;
    skin.bones.reserve(static_cast<std::size_t>(bone_count));
    for (std::int32_t b = 0; b < bone_count; ++b) {
        const std::string place = "bone " + std::to_string(b);
        if (!holds(bytes, offset, 8, 1)) return damaged(place + " lies beyond the end of the file");
        const auto length = load<std::int32_t>(bytes, offset + 4);
        offset += 8;
        if (length <= 0 || !holds(bytes, offset, static_cast<std::uint64_t>(length), 1))
            return damaged(place + ": the length of its name, " + std::to_string(length) +
                           ", does not fit the size of the file");
        const std::string_view name = bytes.substr(offset, static_cast<std::size_t>(length));
        skin.bones.emplace_back(name.substr(0, name.find('\0')));
        offset += name.size();
    }
    if (!holds(bytes, offset, 4, 1)) return damaged("the file ends before the number of strands");
    const auto strand_count = load<std::int32_t>(bytes, offset);
    offset += 4;
    if (strand_count <= 0 ||
        !holds(bytes, offset, static_cast<std::uint64_t>(strand_count), kStrandSize))
        return damaged("the number of strands, " + std::to_string(strand_count) +
                       ", does not fit the size of the file");
    const auto count = static_cast<std::size_t>(strand_count);
    skin.bone.resize(count);
    skin.weight.resize(count);
    std::vector<bool> seen(count, false);
    for (std::size_t i = 0; i < count; ++i, offset += kStrandSize) {
        const auto strand = load<std::int32_t>(bytes, offset);
        const std::string place = "strand " + std::to_string(strand);
        if (strand < 0 || strand >= strand_count)
            return damaged(place + " is out of range (" + std::to_string(strand_count) +
                           " strands)");
        const auto s = static_cast<std::size_t>(strand);
        if (seen[s]) return damaged(place + " stands in the file twice");
        seen[s] = true;
        for (std::size_t k = 0; k < 4; ++k) {
            const auto bone = load<std::int32_t>(bytes, offset + 4 + 8 * k);
            const auto weight = load<float>(bytes, offset + 8 + 8 * k);
            if (!std::isfinite(weight) || weight < 0)
                return damaged(place + ": a weight is negative or not finite");
            // Unused slots may name no bone at all.
            if (weight > 0 && (bone < 0 || bone >= bone_count))
                return damaged(place + ": bone " + std::to_string(bone) + " is out of range (" +
                               std::to_string(bone_count) + " bones)");
            skin.bone[s][k] = weight > 0 ? static_cast<std::uint32_t>(bone) : 0;
            skin.weight[s][k] = weight;
        }
    }
    return skin;
}

}  // namespace keratin
