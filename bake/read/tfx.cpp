#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <algorithm>
#include <cmath>
#include <span>
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

std::string fault_of(const RawCurve& curve) {
    for (std::size_t p = 0; p < curve.points.size(); ++p)
        if (!is_usable(curve.points[p]))
            return "point " + std::to_string(p) + " is not finite or is immensely far away";
    return "its texture coordinate is not finite";
}

// Strands that are not `sound` become problems; the others close up.
void leave_out_unsound(std::span<const std::uint8_t> sound, RawGroom& groom) {
    std::size_t kept = 0;
    for (std::size_t s = 0; s < sound.size(); ++s) {
        if (!sound[s]) {
            groom.problems.push_back({s, 0, fault_of(groom.curves[s])});
            continue;
        }
        if (kept != s) {
            groom.curves[kept] = std::move(groom.curves[s]);
            if (!groom.root_uv.empty()) groom.root_uv[kept] = groom.root_uv[s];
            if (!groom.fixed_points.empty()) groom.fixed_points[kept] = groom.fixed_points[s];
        }
        ++kept;
    }
    groom.curves.resize(kept);
    if (!groom.root_uv.empty()) groom.root_uv.resize(kept);
    if (!groom.fixed_points.empty()) groom.fixed_points.resize(kept);
}

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

    const bool has_fixed = header.floats_per_position == 4;
    RawGroom groom;
    groom.file = file;
    groom.curves.resize(strands);
    if (has_uv) groom.root_uv.resize(strands);
    if (has_fixed) groom.fixed_points.resize(strands);
    std::vector<std::uint8_t> sound(strands);
#pragma omp parallel for schedule(static)
    for (std::uint64_t s = 0; s < strands; ++s) {
        RawCurve& curve = groom.curves[s];
        curve.index = s;
        curve.points.resize(points);
        bool usable = true;
        std::uint32_t fixed = 0;
        std::size_t offset = header.position_offset + s * points * stride;
        for (std::uint64_t p = 0; p < points; ++p, offset += stride) {
            for (int axis = 0; axis < 3; ++axis)
                curve.points[p][axis] = load<float>(bytes, offset + axis * sizeof(float));
            usable = usable && is_usable(curve.points[p]);
            if (has_fixed && fixed == p && load<float>(bytes, offset + 3 * sizeof(float)) == 0)
                ++fixed;
        }
        if (has_uv) {
            const std::size_t at = header.strand_uv_offset + s * 2 * sizeof(float);
            groom.root_uv[s] = {load<float>(bytes, at), load<float>(bytes, at + sizeof(float))};
            usable = usable && groom.root_uv[s].allFinite();
        }
        if (has_fixed) groom.fixed_points[s] = fixed;
        sound[s] = usable;
    }
    leave_out_unsound(sound, groom);
    return groom;
}

}  // namespace keratin
