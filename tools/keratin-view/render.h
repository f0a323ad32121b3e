// Draws strands and meshes into a picture: rays through Embree, sun and sky light, shadows. Works
// on plain spans and knows nothing of assets.
//
// The picture depends on the input alone, in every bit: not on the number of threads.
#pragma once

#include "schema/result.h"
#include "tools/keratin-view/camera.h"
#include "tools/keratin-view/image.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin::view {

enum class HairShading {
    marschner,  // hair as it looks
    kajiya,     // simpler, softer highlights
    flat        // colour with light and shade only: for colours that mean something
};
enum class CurveShape {
    smooth,   // Catmull-Rom spline through the points
    straight  // cones between the points: the polyline as it is simulated
};

// Strands as round curves. Strand s owns the points first_point[s] .. first_point[s + 1] - 1;
// strands of fewer than two points are left out.
struct StrandCurves {
    std::span<const std::uint32_t> first_point;  // [strands + 1]
    std::span<const float> position;             // [points][3] m
    std::span<const float> radius;               // [points] m, as drawn
    std::span<const Float3> color;               // [points] linear
    HairShading shading = HairShading::marschner;
    CurveShape shape = CurveShape::smooth;
};

// smooth: vertices at the same place share one normal; flat: each triangle has its own.
enum class Normals { smooth, flat };

struct Surface {
    std::span<const float> position;          // [vertices][3] m
    std::span<const std::uint32_t> triangle;  // [triangles][3] < vertices
    Float3 color{0.5f, 0.5f, 0.5f};           // linear
    float opacity = 1;                        // 0..1; below 1: no shadow either
    Normals normals = Normals::smooth;
};

struct RenderSettings {
    int width = 800, height = 800;  // pixels, 1..16384
    int samples = 16;               // rays a pixel, 1..4096
    int threads = 0;                // 0: all
    Float3 background_top{0.42f, 0.46f, 0.51f}, background_bottom{0.78f, 0.79f, 0.80f};  // linear
    bool ground = false;  // a floor under the lowest point of everything
};

// Errors: internal when Embree fails (the text is its own), input when a position or radius is not
// finite.
Result<Image> render(std::span<const StrandCurves> strands, std::span<const Surface> surfaces,
                     const Camera& camera, const RenderSettings& settings);

// Radii to draw strands with so that every point is at least `min_pixels` wide in the picture.
struct DrawnRadii {
    std::vector<float> radius;  // [points] m
    std::size_t widened = 0;    // points that were too thin to be seen
    float largest_factor = 1;   // by which the thinnest was widened
};
//   position  [points][3] m        radius  [points] m, real
DrawnRadii widen(std::span<const float> position, std::span<const float> radius,
                 const Camera& camera, int height, float min_pixels);

}  // namespace keratin::view
