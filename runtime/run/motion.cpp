#include "runtime/run/motion.h"

#include <algorithm>
#include <cmath>

namespace keratin {

namespace {

using Quaternion = std::array<double, 4>;

double dot(const Quaternion& a, const Quaternion& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

Quaternion slerp(const Quaternion& a, Quaternion b, double t) {
    double c = dot(a, b);
    if (c < 0) {
        for (double& x : b) x = -x;
        c = -c;
    }
    // Below this angle the sines' quotient is the plain weights to double precision.
    const double angle = std::acos(std::min(c, 1.0));
    const bool near = angle < 1e-8;
    const double wa = near ? 1 - t : std::sin((1 - t) * angle) / std::sin(angle);
    const double wb = near ? t : std::sin(t * angle) / std::sin(angle);
    Quaternion out;
    for (std::size_t i = 0; i < 4; ++i) out[i] = wa * a[i] + wb * b[i];
    const double length = std::sqrt(dot(out, out));
    for (double& x : out) x /= length;
    return out;
}

}  // namespace

RigidTransform pose_at(const Motion& motion, double time) {
    if (motion.empty()) return {};
    const auto after = std::upper_bound(motion.begin(), motion.end(), time,
                                        [](double t, const Keyframe& key) { return t < key.time; });
    if (after == motion.begin()) return {motion.front().translation, motion.front().rotation};
    if (after == motion.end()) return {motion.back().translation, motion.back().rotation};
    const Keyframe &a = after[-1], &b = *after;
    const double t = (time - a.time) / (b.time - a.time);
    RigidTransform out;
    for (std::size_t i = 0; i < 3; ++i)
        out.translation[i] = a.translation[i] + t * (b.translation[i] - a.translation[i]);
    out.rotation = slerp(a.rotation, b.rotation, t);
    return out;
}

measure::Rigid to_rigid(const RigidTransform& m) {
    return {{m.translation[0], m.translation[1], m.translation[2]},
            m.rotation[0],
            m.rotation[1],
            m.rotation[2],
            m.rotation[3]};
}

Schedule make_schedule(double frame, double step, std::uint64_t frames, double duration) {
    Schedule schedule;
    schedule.frame = frame;
    if (step > 0)
        schedule.steps_per_frame =
            static_cast<std::uint64_t>(std::max(1.0, std::ceil(frame / step - 1e-6)));
    if (frames > 0) {
        schedule.step_count = frames * schedule.steps_per_frame;
    } else {
        const double h = frame / static_cast<double>(schedule.steps_per_frame);
        schedule.step_count =
            static_cast<std::uint64_t>(std::max(1.0, std::ceil(duration / h - 1e-6)));
    }
    return schedule;
}

}  // namespace keratin
