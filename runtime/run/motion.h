// Where keyframes put a body at a time, and how a run is cut into steps.
#pragma once

#include "runtime/settings.h"
#include "schema/read/scene.h"
#include "tools/measure/point.h"

#include <cstdint>

namespace keratin {

// Linear between keyframes, rotation spherically along the shorter way, held before the first and
// after the last; no keyframes: at rest.
RigidTransform pose_at(const Motion& motion, double time);

measure::Rigid to_rigid(const RigidTransform& transform);

// A run of equal steps: n = ceil(frame / step - 1e-6) to a frame. Step k (from 0) goes from
// time(k) to time(k + 1); times are k frame / n, never accumulated.
struct Schedule {
    double frame = 1.0 / 60;            // s
    std::uint64_t steps_per_frame = 1;  // n
    std::uint64_t step_count = 0;

    double time(std::uint64_t k) const {
        const std::uint64_t whole = k / steps_per_frame, part = k % steps_per_frame;
        return frame * static_cast<double>(whole) +
               static_cast<double>(part) * frame / static_cast<double>(steps_per_frame);
    }
    bool ends_frame(std::uint64_t k) const { return (k + 1) % steps_per_frame == 0; }
    std::uint64_t frame_count() const { return step_count / steps_per_frame; }
};

// step <= 0: one step a frame. The run takes `frames` frames, or with frames == 0 ends at the first
// step whose end time is >= duration (less a millionth of a step, for rounding).
Schedule make_schedule(double frame, double step, std::uint64_t frames, double duration);

}  // namespace keratin
