#include "tools/keratin-view/camera.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace keratin::view {
namespace {

float radians(float degrees) { return degrees * std::numbers::pi_v<float> / 180; }

// Numbers between commas; empty when something else stands there.
std::vector<float> parse_numbers(const std::string& text) {
    std::vector<float> numbers;
    const char* at = text.data();
    const char* end = at + text.size();
    while (true) {
        while (at < end && *at == ' ') ++at;
        if (at < end && *at == '+') ++at;
        float value = 0;
        const auto [next, error] = std::from_chars(at, end, value);
        if (error != std::errc() || !std::isfinite(value)) return {};
        numbers.push_back(value);
        at = next;
        while (at < end && *at == ' ') ++at;
        if (at == end) return numbers;
        if (*at++ != ',') return {};
    }
}

}  // namespace

CameraAxes camera_axes(const Camera& camera) {
    CameraAxes axes;
    axes.forward = normalized(camera.target - camera.position);
    axes.right = cross(axes.forward, camera.up);
    // Straight up or down: any right hand side will do.
    axes.right = length(axes.right) > 1e-6f ? normalized(axes.right) : perpendicular(axes.forward);
    axes.up = cross(axes.right, axes.forward);
    return axes;
}

Projected project(const Camera& camera, int width, int height, Float3 point) {
    const CameraAxes axes = camera_axes(camera);
    const Float3 d = point - camera.position;
    const float depth = dot(d, axes.forward);
    const float scale = 1 / (pixel_size(camera, height, 1) * depth);
    return {0.5f * width + dot(d, axes.right) * scale, 0.5f * height - dot(d, axes.up) * scale,
            depth};
}

float pixel_size(const Camera& camera, int height, float depth) {
    return 2 * std::tan(radians(camera.fov_deg) / 2) * depth / height;
}

Result<ViewAngles> parse_view_angles(const std::string& text) {
    const std::vector<float> n = parse_numbers(text);
    if (n.size() != 2 && n.size() != 3)
        return Error{
            ErrorCode::usage, "--camera",
            "'" + text +
                "' is not yaw,pitch or yaw,pitch,distance (degrees and metres, such as 35,10)"};
    ViewAngles angles;
    angles.yaw_deg = n[0];
    angles.pitch_deg = n[1];
    if (std::abs(angles.pitch_deg) > 89)
        return Error{ErrorCode::usage, "--camera", "the pitch must lie within -89..89 degrees"};
    if (n.size() == 3) {
        if (n[2] <= 0)
            return Error{ErrorCode::usage, "--camera", "the distance must be greater than 0 m"};
        angles.distance = n[2];
    }
    return angles;
}

Result<Float3> parse_point(const std::string& text) {
    const std::vector<float> n = parse_numbers(text);
    if (n.size() != 3)
        return Error{ErrorCode::usage, "",
                     "'" + text + "' is not a point x,y,z (metres, such as 0,1.5,2)"};
    return Float3{n[0], n[1], n[2]};
}

Framing::Framing(const ViewAngles& angles, int width, int height, float fov_deg, float margin)
    : distance_(angles.distance) {
    const float yaw = radians(angles.yaw_deg), pitch = radians(angles.pitch_deg);
    back_ = {std::sin(yaw) * std::cos(pitch), std::sin(pitch), std::cos(yaw) * std::cos(pitch)};
    turned_.fov_deg = fov_deg;
    turned_.position = {0, 0, 0};
    turned_.target = -back_;
    const CameraAxes axes = camera_axes(turned_);
    right_ = axes.right;
    up_ = axes.up;
    slope_y_ = std::tan(radians(fov_deg) / 2) * (1 - 2 * margin);
    slope_x_ = slope_y_ * float(width) / float(height);
    constexpr float lowest = std::numeric_limits<float>::lowest();
    right_edge_ = left_edge_ = top_edge_ = bottom_edge_ = nearest_ = lowest;
    farthest_ = -lowest;
}

void Framing::include(std::span<const float> points) {
    for (std::size_t i = 0; i + 2 < points.size(); i += 3) {
        const Float3 p{points[i], points[i + 1], points[i + 2]};
        const float x = dot(p, right_), y = dot(p, up_), z = dot(p, back_);
        if (!std::isfinite(x + y + z)) continue;
        right_edge_ = std::max(right_edge_, x + slope_x_ * z);
        left_edge_ = std::max(left_edge_, -x + slope_x_ * z);
        top_edge_ = std::max(top_edge_, y + slope_y_ * z);
        bottom_edge_ = std::max(bottom_edge_, -y + slope_y_ * z);
        nearest_ = std::max(nearest_, z);
        farthest_ = std::min(farthest_, z);
    }
}

Camera Framing::camera() const {
    if (nearest_ < farthest_) {
        constexpr float h = 0.5f;
        const float cube[] = {-h, -h, -h, h, -h, -h, -h, h, -h, h, h, -h,
                              -h, -h, h,  h, -h, h,  -h, h, h,  h, h, h};
        Framing metre = *this;
        metre.include(cube);
        return metre.camera();
    }
    // With the eye at (ex, ey, ez) a point is inside when |px - ex| <= slope (ez - pz), likewise in
    // y. Each of the four edges bounds one combination of the eye's coordinates from below; the
    // nearest eye that satisfies all of them is wanted.
    const float ex = (right_edge_ - left_edge_) / 2, ey = (top_edge_ - bottom_edge_) / 2;
    float ez = std::max((right_edge_ + left_edge_) / (2 * slope_x_),
                        (top_edge_ + bottom_edge_) / (2 * slope_y_));
    const float middle = (nearest_ + farthest_) / 2;
    // A single point, or a line along the view, would put the eye into it.
    constexpr float closest = 1e-3f;  // m
    ez = std::max(ez, nearest_ + closest);
    if (distance_) ez = middle + *distance_;
    Camera camera = turned_;
    camera.position = right_ * ex + up_ * ey + back_ * ez;
    camera.target = right_ * ex + up_ * ey + back_ * middle;
    return camera;
}

Camera frame_camera(std::span<const float> points, const ViewAngles& angles, int width, int height,
                    float fov_deg, float margin) {
    Framing framing(angles, width, height, fov_deg, margin);
    framing.include(points);
    return framing.camera();
}

}  // namespace keratin::view
