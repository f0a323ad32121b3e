#include "runtime/run/motion.h"

#include "runtime/root_transform.h"

#include <catch2/catch.hpp>

#include <numbers>

using namespace keratin;

namespace {

Keyframe key(double time, Double3 translation, double yaw) {
    return {time, translation, {0, std::sin(yaw / 2), 0, std::cos(yaw / 2)}};
}

double yaw_of(const RigidTransform& m) { return 2 * std::atan2(m.rotation[1], m.rotation[3]); }

}  // namespace

TEST_CASE("keyframes are interpolated evenly in place and angle, and held outside") {
    const double turn = 2.0;  // rad
    const Motion motion{key(1, {1, 0, 0}, 0), key(3, {2, 4, 0}, turn)};
    CHECK(pose_at(motion, 0).translation == Double3{1, 0, 0});
    CHECK(pose_at(motion, 9).translation == Double3{2, 4, 0});
    CHECK(yaw_of(pose_at(motion, 9)) == Approx(turn));
    const RigidTransform half = pose_at(motion, 1.5);
    CHECK(half.translation[0] == Approx(1.25));
    CHECK(half.translation[1] == Approx(1));
    CHECK(yaw_of(half) == Approx(turn / 4));
    CHECK(pose_at({}, 5) == RigidTransform{});
}

TEST_CASE("a rotation takes the shorter way and stays a unit quaternion") {
    Motion motion{key(0, {}, 0), key(1, {}, 0.5)};
    for (double& c : motion[1].rotation) c = -c;  // the same rotation
    const RigidTransform half = pose_at(motion, 0.5);
    CHECK(yaw_of(half) == Approx(0.25));
    for (double t = 0; t < 1; t += 0.1) {
        const auto& q = pose_at(motion, t).rotation;
        CHECK(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] == Approx(1).epsilon(1e-14));
    }
}

TEST_CASE("composed transforms do one after the other") {
    const RigidTransform a = pose_at({key(0, {1, 2, 3}, 0.7)}, 0),
                         b = pose_at({key(0, {-2, 0, 1}, -1.9)}, 0);
    const measure::Point x{0.3, -0.4, 0.5};
    const measure::Point wanted = measure::apply(to_rigid(a), measure::apply(to_rigid(b), x));
    CHECK(measure::distance(measure::apply(to_rigid(chained(a, b)), x), wanted) < 1e-15);
}

TEST_CASE("a frame is cut into the fewest equal steps that are no longer than asked for") {
    CHECK(make_schedule(1.0 / 60, 0, 1, 0).steps_per_frame == 1);
    CHECK(make_schedule(1.0 / 60, 1.0 / 60, 1, 0).steps_per_frame == 1);
    CHECK(make_schedule(1.0 / 60, 1.0 / 240, 1, 0).steps_per_frame == 4);
    CHECK(make_schedule(1.0 / 60, 0.001, 1, 0).steps_per_frame == 17);
    CHECK(make_schedule(0.0166667, 0.0166667 / 3, 1, 0).steps_per_frame == 3);
    CHECK(make_schedule(0.01, 1, 1, 0).steps_per_frame == 1);
}

TEST_CASE("times are never accumulated, and frames fall on their multiples exactly") {
    const Schedule schedule = make_schedule(1.0 / 60, 0.001, 100000, 0);
    CHECK(schedule.step_count == 1700000);
    CHECK(schedule.frame_count() == 100000);
    CHECK(schedule.time(17 * 99999) == 99999 * (1.0 / 60));
    CHECK(schedule.time(17 * 60 + 1) == 60 * (1.0 / 60) + (1.0 / 60) / 17);
    CHECK(schedule.ends_frame(16));
    CHECK_FALSE(schedule.ends_frame(15));
}

TEST_CASE("a run ends at the first step whose end time reaches the duration") {
    CHECK(make_schedule(0.1, 0.05, 0, 1).step_count == 20);
    CHECK(make_schedule(0.1, 0.05, 0, 1.01).step_count == 21);
    CHECK(make_schedule(1.0 / 60, 0, 0, 5).step_count == 300);
    CHECK(make_schedule(1.0 / 60, 0, 0, 1e-9).step_count == 1);
}
