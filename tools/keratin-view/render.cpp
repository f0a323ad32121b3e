#include "tools/keratin-view/render.h"

#include "tools/keratin-view/ray_scene.h"
#include "tools/keratin-view/sampling.h"
#include "tools/keratin-view/shade.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <omp.h>
#include <string>

namespace keratin::view {
namespace {

constexpr int kMaxLayers = 64;  // translucent surfaces behind each other
constexpr int kMaxSide = 16384, kMaxSamples = 4096;

// Brightest parts are bent below white instead of cut off; the hue stays.
Float3 shoulder(Float3 light) {
    constexpr float knee = 0.6f;
    const float most = std::max({light.x, light.y, light.z});
    if (most <= knee) return light;
    return light * ((knee + (1 - knee) * (1 - std::exp(-(most - knee) / (1 - knee)))) / most);
}

// A soft glow behind the middle of a gradient.
Float3 background(const RenderSettings& settings, float x, float y) {
    const float width = float(settings.width), height = float(settings.height);
    const float dx = (x - 0.5f * width) / height, dy = (y - 0.55f * height) / height;
    const Float3 base = mix(settings.background_top, settings.background_bottom,
                            std::clamp(y / height, 0.0f, 1.0f));
    return base * (0.86f + 0.22f * std::exp(-2.5f * (dx * dx + dy * dy)));
}

// What the samples of a picture share.
struct Shot {
    const RayScene& scene;
    const RenderSettings& settings;
    Float3 position;  // of the camera
    CameraAxes axes;
    Rig rig;
    float pixel;  // m, at 1 m
    std::uint32_t sample_mask;
};

// One ray through the pixel (px, py), spread by a tent filter of two pixels.
Float3 sample(const Shot& shot, int px, int py, std::uint32_t number) {
    const int width = shot.settings.width, height = shot.settings.height;
    const std::uint32_t pixel = std::uint32_t(py) * width + px;
    const Pair at = sample_pair(pixel, number, 0, shot.sample_mask);
    const auto tent = [](float u) {
        return u < 0.5f ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
    };
    const float x = px + 0.5f + tent(at.a), y = py + 0.5f + tent(at.b);
    const Float3 direction =
        normalized(shot.axes.forward + shot.axes.right * ((x - 0.5f * width) * shot.pixel) +
                   shot.axes.up * ((0.5f * height - y) * shot.pixel));

    const RayHit hit = shot.scene.solid(shot.position, direction);
    Float3 behind;
    if (!hit.part) {
        behind = background(shot.settings, x, y);
    } else {
        const bool hair = hit.part->strands;
        const Randoms random{sample_pair(pixel, number, 1, shot.sample_mask),
                             hair ? sample_pair(pixel, number / 2, 2, shot.sample_mask / 2)
                                  : sample_pair(pixel, number, 2, shot.sample_mask),
                             ((number ^ px ^ py) & 1) != 0};
        if (hair)
            behind = shoulder(shade_hair(shot.scene, shot.rig, hit, -direction, random));
        else if (hit.part->surface)
            behind = shoulder(shade_surface(shot.scene, shot.rig, hit, -direction, random));
        else
            behind =
                background(shot.settings, x, y) * shade_ground(shot.scene, shot.rig, hit, random);
    }

    const float far = hit.part ? hit.distance : std::numeric_limits<float>::infinity();
    Float3 sum;
    float left = 1, near = 0;  // share of the picture that what is farther away still has
    for (int layer = 0; layer < kMaxLayers; ++layer) {
        const RayHit glass = shot.scene.translucent(shot.position, direction, near, far);
        if (!glass.part) break;
        const float opacity = glass.part->surface->opacity;
        sum += shoulder(shade_translucent(shot.rig, glass, -direction)) * (left * opacity);
        left *= 1 - opacity;
        near = glass.distance * (1 + 1e-5f);
    }
    return sum + behind * left;
}

int threads_to_use(int wanted) { return wanted > 0 ? wanted : omp_get_max_threads(); }

// Names the first number that is not finite; `components` a point.
Result<void> check_finite(std::span<const float> values, std::size_t components, const char* what) {
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
            return Error{ErrorCode::input, std::string(what) + " " + std::to_string(i / components),
                         "has a number that is not finite"};
    return {};
}

}  // namespace

DrawnRadii widen(std::span<const float> position, std::span<const float> radius,
                 const Camera& camera, int height, float min_pixels) {
    const CameraAxes axes = camera_axes(camera);
    DrawnRadii drawn;
    drawn.radius.assign(radius.begin(), radius.end());
    for (std::size_t i = 0; i < radius.size(); ++i) {
        const Float3 p{position[3 * i], position[3 * i + 1], position[3 * i + 2]};
        const float depth = dot(p - camera.position, axes.forward);
        if (depth <= 0) continue;
        const float least = 0.5f * min_pixels * pixel_size(camera, height, depth);
        if (radius[i] >= least) continue;
        drawn.radius[i] = least;
        ++drawn.widened;
        if (radius[i] > 0) drawn.largest_factor = std::max(drawn.largest_factor, least / radius[i]);
    }
    return drawn;
}

Result<Image> render(std::span<const StrandCurves> strands, std::span<const Surface> surfaces,
                     const Camera& camera, const RenderSettings& settings) {
    if (settings.width < 1 || settings.height < 1 || settings.width > kMaxSide ||
        settings.height > kMaxSide)
        return Error{ErrorCode::usage, "", "the picture must be 1x1 to 16384x16384 pixels"};
    if (settings.samples < 1 || settings.samples > kMaxSamples)
        return Error{ErrorCode::usage, "", "the samples must be 1..4096 a pixel"};
    for (const StrandCurves& s : strands) {
        if (const auto ok = check_finite(s.position, 3, "strand point"); !ok) return ok.error();
        if (const auto ok = check_finite(s.radius, 1, "radius of strand point"); !ok)
            return ok.error();
    }
    for (const Surface& s : surfaces)
        if (const auto ok = check_finite(s.position, 3, "mesh vertex"); !ok) return ok.error();

    const auto scene = RayScene::build(strands, surfaces, settings.ground);
    if (!scene) return scene.error();
    std::uint32_t samples = 1;
    while (samples < std::uint32_t(settings.samples)) samples *= 2;
    const CameraAxes axes = camera_axes(camera);
    const int width = settings.width, height = settings.height;
    const Shot shot{*scene,     settings,       camera.position,
                    axes,       make_rig(axes), pixel_size(camera, height, 1),
                    samples - 1};

    Image image = make_image(width, height, {0, 0, 0});
    constexpr int tile = 16;  // pixels a side: rays of a tile meet the same part of the tree
    const int columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
#pragma omp parallel for schedule(dynamic) num_threads(threads_to_use(settings.threads))
    for (int t = 0; t < columns * rows; ++t) {
        const int left = t % columns * tile, top = t / columns * tile;
        for (int py = top; py < std::min(height, top + tile); ++py)
            for (int px = left; px < std::min(width, left + tile); ++px) {
                Float3 sum;
                for (int s = 0; s < settings.samples; ++s) sum += sample(shot, px, py, s);
                sum = sum * (1.0f / float(settings.samples));
                std::uint8_t* out = &image.rgb[3 * (std::size_t(py) * width + px)];
                out[0] = to_srgb(sum.x), out[1] = to_srgb(sum.y), out[2] = to_srgb(sum.z);
            }
    }
    return image;
}

}  // namespace keratin::view
