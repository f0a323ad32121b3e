// Writes strands back to where artists work: Alembic curves (.abc, all frames in one file), Cem
// Yuksel .hair and OBJ lines (.obj; one file a frame). For programs; keratin::runtime does not
// link this.
#pragma once

#include "schema/result.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// What stays the same over all frames. Empty spans are left out of the file.
struct ExportStrands {
    std::vector<std::uint32_t> first_point;  // [strands + 1], from 0, ascending
    std::vector<float> radius;               // [strands] m, at the root
    std::vector<float> uv;                   // [strands * 2]
    std::vector<std::uint32_t> id;           // [strands]
    std::vector<std::uint8_t> is_guide;      // [strands] 1: a guide
};

// Error (usage) when the ending of a path names no format.
Result<void> check_export_ending(const std::string& path);

// One file (Alembic) or one file a frame.
class StrandExporter {
  public:
    // The ending of path chooses the format. frame_count > 1 puts the frame's number before the
    // ending of .hair and .obj: tail.0001.obj. Errors: usage for an unknown ending; input for more
    // strands or points than the format holds (.hair: 65 536 points a strand); io.
    static Result<std::unique_ptr<StrandExporter>> create(const std::string& path,
                                                          ExportStrands strands,
                                                          double frame_seconds,
                                                          std::uint32_t frame_count);
    virtual ~StrandExporter() = default;

    // The next frame: position [points * 3] m, y up.
    virtual Result<void> add(std::span<const float> position) = 0;
    // Without finish() no Alembic file is left behind.
    virtual Result<void> finish() = 0;
};

// The writer of Alembic files behind StrandExporter.
Result<std::unique_ptr<StrandExporter>> create_alembic_exporter(const std::string& path,
                                                                ExportStrands strands,
                                                                double frame_seconds);

}  // namespace keratin
