#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <cmath>
#include <string>

namespace keratin {

// 0 "HAIR"; 4 u32 strands; 8 u32 points; 12 u32 arrays (bit 0 segments, 1 points, 2 thickness,
// 3 transparency, 4 colour); 16 u32 default segments; 20 defaults of the other arrays; 40 text;
// 128 u16 segments[strands] if bit 0; f32 xyz[points]; f32 thickness[points] if bit 2; the rest is
// not needed here.
Result<RawGroom> read_hair(std::string_view bytes, const std::string& file) {
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file, what};
    };
    constexpr std::size_t kHeaderSize = 128;
    enum : std::uint32_t { segments_bit = 1, points_bit = 2, thickness_bit = 4, known_bits = 31 };
    if (!bytes.starts_with("HAIR")) return damaged("this is not a .hair file");
    if (bytes.size() < kHeaderSize) return damaged("the file ends inside its header; it is cut");
    const auto strands = load<std::uint32_t>(bytes, 4), points = load<std::uint32_t>(bytes, 8);
    const auto arrays = load<std::uint32_t>(bytes, 12);
    const auto default_segments = load<std::uint32_t>(bytes, 16);
    if (strands == 0) return damaged("the file holds no strands");
    if (!(arrays & points_bit)) return damaged("the file holds no points");
    if (arrays & ~known_bits) return damaged("the file announces arrays that are not known");
    const bool has_segments = (arrays & segments_bit) != 0;
    const bool has_thickness = (arrays & thickness_bit) != 0;
    if (has_segments && !holds(bytes, kHeaderSize, strands, sizeof(std::uint16_t)))
        return damaged("the file ends before the segment counts of its " + std::to_string(strands) +
                       " strands; it is cut");
    const auto segments_of = [&](std::size_t s) -> std::uint64_t {
        return has_segments ? load<std::uint16_t>(bytes, kHeaderSize + s * sizeof(std::uint16_t))
                            : default_segments;
    };
    // Without an array nothing bounds the number of strands yet, so they are not counted one by
    // one.
    std::uint64_t sum = strands * (std::uint64_t{default_segments} + 1);
    if (has_segments) {
        sum = 0;
        for (std::size_t s = 0; s < strands; ++s) sum += segments_of(s) + 1;
    }
    if (sum != points)
        return damaged("the strands have " + std::to_string(sum) +
                       " points by their segments, but the header says " + std::to_string(points));
    const std::size_t position_at =
        kHeaderSize + (has_segments ? strands * sizeof(std::uint16_t) : 0);
    const std::size_t stride = 3 * sizeof(float);
    if (!holds(bytes, position_at, points, stride + (has_thickness ? sizeof(float) : 0)))
        return damaged("the file ends before its " + std::to_string(points) + " points; it is cut");
    const std::size_t thickness_at = position_at + points * stride;

    RawGroom groom;
    groom.file = file;
    groom.curves.reserve(strands);
    std::size_t first = 0;
    for (std::size_t s = 0; s < strands; ++s) {
        RawCurve curve;
        curve.index = s;
        std::string fault;
        const auto count = static_cast<std::size_t>(segments_of(s) + 1);
        if (count < 2) fault = "it has one point";
        std::vector<double> radius;
        for (std::size_t p = first; p < first + count; ++p) {
            const std::size_t at = position_at + p * stride;
            const Vec3 point(load<float>(bytes, at), load<float>(bytes, at + 4),
                             load<float>(bytes, at + 8));
            if (!is_usable(point) && fault.empty())
                fault = "point " + std::to_string(p - first) +
                        " is not finite or is immensely far away";
            curve.points.push_back(point);
            if (!has_thickness) continue;
            const auto thickness = load<float>(bytes, thickness_at + p * sizeof(float));
            if (!(std::isfinite(thickness) && thickness >= 0) && fault.empty())
                fault = "the thickness of point " + std::to_string(p - first) +
                        " is negative or not finite";
            radius.push_back(0.5 * thickness);
        }
        first += count;
        if (!fault.empty()) {
            groom.problems.push_back({s, 0, fault});
            continue;
        }
        groom.curves.push_back(std::move(curve));
        if (has_thickness) groom.point_radius.push_back(std::move(radius));
    }
    return groom;
}

}  // namespace keratin
