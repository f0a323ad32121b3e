// What the files of data/revision hold: tests/tools/diff/full_asset.h, and this run.
#pragma once

#include "schema/cache.h"

namespace keratin::test {

// Two strands, one explicit guide each, without an asset.
inline CacheHead recorded_head() {
    CacheHead head;
    head.tool_version = "test";
    head.solver = "strand";
    head.scene = "recorded.json";
    head.frame = 1.0 / 60;
    head.guide_first_point = {0, 3, 5};
    head.guide_lane = {0xffffffffu, 0xffffffffu};
    head.strand_first_point = {0, 3, 5};
    head.strand_radius = {4e-5f, 5e-5f};
    return head;
}

inline CacheFrame recorded_frame(std::uint32_t number) {
    CacheFrame frame;
    frame.number = number;
    frame.time = number / 60.0;
    for (int i = 0; i < 15; ++i) frame.guide_position.push_back(0.01f * float(i + int(number)));
    frame.strand_position = frame.guide_position;
    frame.strand_velocity.assign(15, 0.5f);
    frame.strand_density.assign(5, 1);
    frame.colliders.push_back({CacheShape::capsule, {0, 0, 0}, {0, 1, 0}, 0.1f, {0, 0, 0, 1}});
    return frame;
}
inline constexpr std::uint32_t kRecordedFrames = 2;

}  // namespace keratin::test
