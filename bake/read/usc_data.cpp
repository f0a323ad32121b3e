#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <string>

namespace keratin {
namespace {

constexpr std::size_t kPlainFloats = 3;  // xyz
constexpr std::size_t kWideFloats = 7;   // xyz, a direction or colour, a label

// Whether strands with so many floats a point fill the file to its last byte.
bool fits(std::string_view bytes, std::uint64_t strands, std::size_t floats) {
    std::size_t at = 4;
    for (std::uint64_t s = 0; s < strands; ++s) {
        if (!holds(bytes, at, 1, 4)) return false;
        const auto count = load<std::int32_t>(bytes, at);
        at += 4;
        const std::size_t stride = floats * sizeof(float);
        if (count < 0 || !holds(bytes, at, static_cast<std::uint64_t>(count), stride)) return false;
        at += static_cast<std::size_t>(count) * stride;
    }
    return at == bytes.size();
}

}  // namespace

// i32 strands; per strand i32 n, n points. The length of the file tells which kind of points.
Result<RawGroom> read_usc_data(std::string_view bytes, const std::string& file) {
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file, what};
    };
    if (bytes.size() < 4) return damaged("the file ends before its number of strands");
    const auto strands = load<std::int32_t>(bytes, 0);
    if (strands <= 0 || !holds(bytes, 4, static_cast<std::uint64_t>(strands), 4))
        return damaged("the number of strands, " + std::to_string(strands) +
                       ", does not fit the size of the file");
    const auto count = static_cast<std::uint64_t>(strands);
    std::size_t floats = kPlainFloats;
    if (!fits(bytes, count, floats)) floats = kWideFloats;
    if (!fits(bytes, count, floats))
        return damaged(
            "the strands do not fill the file exactly, neither with 3 nor with 7 numbers "
            "a point; it is cut or not a .data file");
    RawGroom groom;
    groom.file = file;
    groom.curves.reserve(count);
    std::size_t at = 4;
    for (std::uint64_t s = 0; s < count; ++s) {
        const auto points = static_cast<std::size_t>(load<std::int32_t>(bytes, at));
        at += 4;
        RawCurve curve;
        curve.index = s;
        std::string fault;
        if (points < 2)
            fault = points == 0 ? "it has no points"
                                : "it has one point, which marks a root without hair";
        for (std::size_t p = 0; p < points; ++p, at += floats * sizeof(float)) {
            curve.points.emplace_back(load<float>(bytes, at), load<float>(bytes, at + 4),
                                      load<float>(bytes, at + 8));
            if (!is_usable(curve.points.back()) && fault.empty())
                fault = "point " + std::to_string(p) + " is not finite or is immensely far away";
        }
        if (fault.empty())
            groom.curves.push_back(std::move(curve));
        else
            groom.problems.push_back({s, 0, fault});
    }
    return groom;
}

}  // namespace keratin
