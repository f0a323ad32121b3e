#include "runtime/run/points_csv.h"

#include <charconv>

namespace keratin {

namespace {

void append(std::string& out, double value) {
    char text[32];
    out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

}  // namespace

Result<PointsCsv> PointsCsv::create(const std::string& path) {
    auto file = PendingFile::create(path);
    if (!file) return file.error();
    PointsCsv out(std::move(*file));
    if (auto ok = out.file_.write(std::string_view("frame,time,strand,point,x,y,z\n")); !ok)
        return ok.error();
    return out;
}

Result<void> PointsCsv::add(std::uint64_t frame, double time, const RunLayout& layout,
                            const RunState& state) {
    std::string head = std::to_string(frame) + ",", text;
    append(head, time);
    const auto& first = layout.head.guide_first_point;
    for (std::size_t s = 0; s + 1 < first.size(); ++s)
        for (std::uint32_t p = first[s]; p < first[s + 1]; ++p) {
            text += head + "," + std::to_string(s) + "," + std::to_string(p - first[s]);
            for (const double c : {state.position[p].x, state.position[p].y, state.position[p].z}) {
                text += ',';
                append(text, c);
            }
            text += '\n';
        }
    return file_.write(text);
}

}  // namespace keratin
