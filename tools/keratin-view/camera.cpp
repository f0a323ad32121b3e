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

Camera frame_camera(std::span<const float> points, const ViewAngles& angles, int width, int height,
                    float fov_deg, float margin) {
    const float yaw = radians(angles.yaw_deg), pitch = radians(angles.pitch_deg);
    const Float3 back{std::sin(yaw) * std::cos(pitch), std::sin(pitch),
                      std::cos(yaw) * std::cos(pitch)};
    Camera camera;
    camera.fov_deg = fov_deg;
    camera.target = -back;
    camera.position = {0, 0, 0};
    const CameraAxes axes = camera_axes(camera);

    constexpr float h = 0.5f;  // corners of the metre around the origin
    const float cube[] = {-h, -h, -h, h, -h, -h, -h, h, -h, h, h, -h,
                          -h, -h, h,  h, -h, h,  -h, h, h,  h, h, h};
    if (points.size() < 3) points = cube;

    // In axes (right, up, back) with the eye at (ex, ey, ez), a point is inside when
    // |px - ex| <= tx (ez - pz), likewise in y. Each of the four edges bounds one combination of
    // the eye's coordinates from below; the nearest eye that satisfies all of them is wanted.
    const float ty = std::tan(radians(fov_deg) / 2) * (1 - 2 * margin);
    const float tx = ty * float(width) / float(height);
    constexpr float lowest = std::numeric_limits<float>::lowest();
    float left = lowest, right = lowest, bottom = lowest, top = lowest;
    float nearest = lowest, farthest = -lowest;
    for (std::size_t i = 0; i + 2 < points.size(); i += 3) {
        const Float3 p{points[i], points[i + 1], points[i + 2]};
        const float x = dot(p, axes.right), y = dot(p, axes.up), z = dot(p, back);
        right = std::max(right, x + tx * z);
        left = std::max(left, -x + tx * z);
        top = std::max(top, y + ty * z);
        bottom = std::max(bottom, -y + ty * z);
        nearest = std::max(nearest, z);
        farthest = std::min(farthest, z);
    }
    const float ex = (right - left) / 2, ey = (top - bottom) / 2;
    float ez = std::max((right + left) / (2 * tx), (top + bottom) / (2 * ty));
    const float middle = (nearest + farthest) / 2;
    // A single point, or a line along the view, would put the eye into it.
    ez = std::max(ez, nearest + 1e-3f);
    if (angles.distance) ez = middle + *angles.distance;
    camera.position = axes.right * ex + axes.up * ey + back * ez;
    camera.target = axes.right * ex + axes.up * ey + back * middle;
    return camera;
}

}  // namespace keratin::view
