#include "runtime/export/strand_export.h"

#include "schema/files/write_file.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <limits>

namespace keratin {

namespace {

std::string ending_of(const std::string& path) {
    const std::size_t dot = path.find_last_of("./");
    return dot == std::string::npos || path[dot] == '/' ? "" : path.substr(dot);
}

// Formats that hold one moment: a file a frame.
class FramesExporter final : public StrandExporter {
  public:
    using Serialise = std::string (*)(const ExportStrands&, std::span<const float>);

    FramesExporter(std::string path, ExportStrands strands, std::uint32_t frame_count,
                   Serialise serialise)
        : path_(std::move(path)),
          strands_(std::move(strands)),
          frame_count_(frame_count),
          serialise_(serialise) {}

    Result<void> add(std::span<const float> position) override {
        return write_file(next_path(), serialise_(strands_, position));
    }
    Result<void> finish() override { return {}; }

  private:
    std::string next_path() {
        if (frame_count_ <= 1) return path_;
        std::array<char, 16> number{};
        std::snprintf(number.data(), number.size(), ".%04u", frame_++);
        const std::string ending = ending_of(path_);
        return path_.substr(0, path_.size() - ending.size()) + number.data() + ending;
    }

    std::string path_;
    ExportStrands strands_;
    std::uint32_t frame_count_, frame_ = 0;
    Serialise serialise_;
};

// Cem Yuksel's .hair: a 128-byte header, then segments, points and thickness.
std::string to_hair(const ExportStrands& strands, std::span<const float> position) {
    struct Header {
        char magic[4] = {'H', 'A', 'I', 'R'};
        std::uint32_t strand_count = 0, point_count = 0;
        std::uint32_t arrays = 0b11;  // segments, points
        std::uint32_t segments = 0;
        float thickness = 1, transparency = 0, colour[3] = {1, 1, 1};
        char info[88] = "keratin, metres, y up";
    };
    static_assert(sizeof(Header) == 128);
    const std::size_t count = strands.first_point.size() - 1;
    Header header;
    header.strand_count = static_cast<std::uint32_t>(count);
    header.point_count = strands.first_point.back();
    if (!strands.radius.empty()) header.arrays |= 0b100;

    std::string out;
    const auto append = [&](const auto& value) {
        out.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    append(header);
    for (std::size_t s = 0; s < count; ++s)
        append(static_cast<std::uint16_t>(strands.first_point[s + 1] - strands.first_point[s] - 1));
    out.append(reinterpret_cast<const char*>(position.data()), position.size_bytes());
    if (!strands.radius.empty())
        for (std::size_t s = 0; s < count; ++s)
            for (std::uint32_t p = strands.first_point[s]; p < strands.first_point[s + 1]; ++p)
                append(2 * strands.radius[s]);
    return out;
}

// Shortest decimal text that reads back as the same float, whatever the locale.
void append_number(std::string& out, float value) {
    std::array<char, 32> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
    out.append(text.data(), end.ptr);
}

// Lines of two points, root to tip: of longer ones Blender 3.4 reads the first two points alone.
std::string to_obj(const ExportStrands& strands, std::span<const float> position) {
    std::string out = "# strands as chains of edges, metres, y up\n";
    for (std::size_t p = 0; p + 2 < position.size(); p += 3) {
        out += 'v';
        for (std::size_t axis = 0; axis < 3; ++axis) {
            out += ' ';
            append_number(out, position[p + axis]);
        }
        out += '\n';
    }
    for (std::size_t s = 0; s + 1 < strands.first_point.size(); ++s) {
        for (std::uint32_t p = strands.first_point[s] + 1; p < strands.first_point[s + 1]; ++p)
            out += "l " + std::to_string(p) + ' ' + std::to_string(p + 1) + '\n';
    }
    return out;
}

}  // namespace

Result<void> check_export_ending(const std::string& path) {
    const std::string ending = ending_of(path);
    if (ending == ".abc" || ending == ".hair" || ending == ".obj") return {};
    return Error{ErrorCode::usage, path, "the ending of an export must be .abc, .hair or .obj"};
}

Result<std::unique_ptr<StrandExporter>> StrandExporter::create(const std::string& path,
                                                               ExportStrands strands,
                                                               double frame_seconds,
                                                               std::uint32_t frame_count) {
    if (auto ok = check_export_ending(path); !ok) return ok.error();
    const std::string ending = ending_of(path);
    if (ending == ".abc") return create_alembic_exporter(path, std::move(strands), frame_seconds);
    constexpr std::uint32_t kMostSegments = std::numeric_limits<std::uint16_t>::max();
    for (std::size_t s = 0; ending == ".hair" && s + 1 < strands.first_point.size(); ++s)
        if (strands.first_point[s + 1] - strands.first_point[s] - 1 > kMostSegments)
            return Error{
                ErrorCode::input, path,
                "strand " + std::to_string(s) + " has more points than a .hair file holds (65536)"};
    return std::unique_ptr<StrandExporter>(std::make_unique<FramesExporter>(
        path, std::move(strands), frame_count, ending == ".hair" ? to_hair : to_obj));
}

}  // namespace keratin
