#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace keratin {
namespace {

// What both versions come down to. An offset of 0 means: absent.
struct TfxHeader {
    std::uint32_t strands = 0, points_per_strand = 0;
    std::uint32_t position_offset = 0, strand_uv_offset = 0;
    std::size_t floats_per_position = 3;
    std::size_t header_size = 0;
};

constexpr std::size_t kVersion3Size = 296, kVersion4Size = 160;

}  // namespace

// Version 3: f32 3.0; u32 strands, points a strand, followers, both ends fixed, 31 reserved,
//            offsets of position (xyz), thickness, strand uv, ...; header of 296 bytes.
// Version 4: f32 4.0; u32 strands, points a strand, offsets of position (xyzw), strand uv, ...;
//            header of 160 bytes; w = 0: the point is carried, not simulated.
Result<RawGroom> read_tfx(std::string_view bytes, const std::string& file) {
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file, what};
    };
    if (bytes.size() < kVersion4Size)
        return damaged("the file ends inside the header (" + std::to_string(bytes.size()) +
                       " bytes); it is cut or not a .tfx file");
    const float version = load<float>(bytes, 0);
    TfxHeader header;
    header.strands = load<std::uint32_t>(bytes, 4);
    header.points_per_strand = load<std::uint32_t>(bytes, 8);
    if (version == 3.0f) {
        if (bytes.size() < kVersion3Size)
            return damaged("the file ends inside the version 3 header; it is cut");
        header.header_size = kVersion3Size;
        header.position_offset = load<std::uint32_t>(bytes, 144);
        header.strand_uv_offset = load<std::uint32_t>(bytes, 152);
    } else if (version == 4.0f) {
        header.header_size = kVersion4Size;
        header.floats_per_position = 4;
        header.position_offset = load<std::uint32_t>(bytes, 12);
        header.strand_uv_offset = load<std::uint32_t>(bytes, 16);
    } else {
        return damaged("this is not a .tfx file of version 3 or 4");
    }
    const std::uint64_t strands = header.strands, points = header.points_per_strand;
    if (strands == 0) return damaged("the file holds no strands");
    if (points < 2)
        return damaged("a strand has " + std::to_string(points) + " points, at least 2 are needed");
    if (header.position_offset < header.header_size)
        return damaged("the offset of the positions, " + std::to_string(header.position_offset) +
                       ", lies inside the header");
    const std::size_t stride = header.floats_per_position * sizeof(float);
    if (!holds(bytes, header.position_offset, strands * points, stride))
        return damaged("the file ends before its " + std::to_string(strands) + " strands of " +
                       std::to_string(points) + " points; it is cut");
    const bool has_uv = header.strand_uv_offset != 0;
    if (has_uv && (header.strand_uv_offset < header.header_size ||
                   !holds(bytes, header.strand_uv_offset, strands, 2 * sizeof(float))))
        return damaged("the texture coordinates of the strands lie outside the file");

    RawGroom groom;
    groom.file = file;
    groom.curves.reserve(strands);
    if (has_uv) groom.root_uv.reserve(strands);
    std::size_t offset = header.position_offset;
    for (std::uint64_t s = 0; s < strands; ++s) {
        RawCurve curve;
        curve.index = s;
        curve.points.resize(points);
        std::uint32_t fixed = 0;
        std::string what;
        for (std::uint64_t p = 0; p < points; ++p, offset += stride) {
            for (int axis = 0; axis < 3; ++axis)
                curve.points[p][axis] = load<float>(bytes, offset + axis * sizeof(float));
            if (!is_usable(curve.points[p]) && what.empty())
                what = "point " + std::to_string(p) + " is not finite or is immensely far away";
            if (header.floats_per_position == 4 && fixed == p &&
                load<float>(bytes, offset + 3 * sizeof(float)) == 0)
                ++fixed;
        }
        Vec2 uv = Vec2::Zero();
        if (has_uv) {
            const std::size_t at = header.strand_uv_offset + s * 2 * sizeof(float);
            uv = {load<float>(bytes, at), load<float>(bytes, at + sizeof(float))};
            if (!uv.allFinite() && what.empty()) what = "its texture coordinate is not finite";
        }
        if (!what.empty()) {
            groom.problems.push_back({s, 0, what});
            continue;
        }
        groom.curves.push_back(std::move(curve));
        if (has_uv) groom.root_uv.push_back(uv);
        if (header.floats_per_position == 4) groom.fixed_points.push_back(fixed);
    }
    return groom;
}

}  // namespace keratin
