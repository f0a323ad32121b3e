// Where a picture is taken from, and the automatic choice of it.
#pragma once

#include "schema/result.h"
#include "tools/keratin-view/float3.h"

#include <array>
#include <optional>
#include <span>
#include <string>

namespace keratin::view {

struct Camera {
    Float3 position{0, 0, 1};  // m
    Float3 target{0, 0, 0};    // m, in the middle of the picture
    Float3 up{0, 1, 0};        // direction, roughly
    float fov_deg = 30;        // angle between the lower and the upper edge of the picture
};

// Unit axes of the camera: right and up in the picture, forward into it.
struct CameraAxes {
    Float3 right, up, forward;
};
CameraAxes camera_axes(const Camera& camera);

// Where a point stands in a picture of width x height pixels: x to the right and y down in pixels,
// (0, 0) the top left corner of the first pixel; depth in m along the view. A depth <= 0 lies
// behind the camera, its x and y mean nothing.
struct Projected {
    float x = 0, y = 0, depth = 0;
};
Projected project(const Camera& camera, int width, int height, Float3 point);
// Width of a pixel in m at the depth in m.
float pixel_size(const Camera& camera, int height, float depth);

// The direction that a camera looks from: yaw 0 from +z, 90 from +x; pitch > 0 from above.
struct ViewAngles {
    float yaw_deg = 35, pitch_deg = 8;
    std::optional<float>
        distance;  // m from the middle of what is looked at; absent: all of it fits
};
// "yaw,pitch" or "yaw,pitch,distance". Errors (usage): not two or three numbers; pitch not within
// -89..89; distance not > 0.
Result<ViewAngles> parse_view_angles(const std::string& text);
// "x,y,z". Errors (usage).
Result<Float3> parse_point(const std::string& text);

// Finds the camera that sees all points given to include() as large as they fit into a picture of
// width x height, from the given angles; `margin` is the share of the picture that stays free at
// each edge. Points may come in pieces: frames of a run share one camera.
class Framing {
  public:
    Framing(const ViewAngles& angles, int width, int height, float fov_deg = 30,
            float margin = 0.06f);
    // Component c of point i at 3 i + c, m; points that are not finite are left out.
    void include(std::span<const float> points);
    // Without any point: a metre around the origin.
    Camera camera() const;

  private:
    Camera turned_;  // at the origin, looking along the view
    Float3 right_, up_, back_;
    std::optional<float> distance_;
    float slope_x_, slope_y_;  // of the picture's edges
    // Largest x + slope z and so on over the points, in the axes right, up, back.
    float right_edge_, left_edge_, top_edge_, bottom_edge_, nearest_, farthest_;
};

// The same for points at once.
Camera frame_camera(std::span<const float> points, const ViewAngles& angles, int width, int height,
                    float fov_deg = 30, float margin = 0.06f);

}  // namespace keratin::view
