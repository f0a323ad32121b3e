#include "tools/keratin-view/difference.h"

#include "tools/keratin-view/color.h"
#include "tools/keratin-view/draw.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unordered_map>

namespace keratin::view {
namespace {

constexpr Float3 kOnlyA{0.7f, 0.02f, 0.02f}, kOnlyB{0.65f, 0.03f, 0.55f},
    kSame{0.30f, 0.30f, 0.30f}, kBody{0.55f, 0.55f, 0.55f};
constexpr float kMinPixels = 1.5f;

Float3 load(std::span<const float> values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

// Position of strand s at share u of its points, 0 the root, 1 the tip.
Float3 at_share(const SubjectStrands& strands, std::size_t s, float u) {
    const std::uint32_t first = strands.first_point[s], last = strands.first_point[s + 1] - 1;
    const float at = u * float(last - first);
    const std::uint32_t p = first + std::min(std::uint32_t(at), last - first);
    const std::uint32_t next = std::min(p + 1, last);
    return mix(load(strands.position, p), load(strands.position, next), at - std::floor(at));
}

void append(const SubjectStrands& from, std::size_t s, SubjectStrands& to) {
    const std::uint32_t first = from.first_point[s], end = from.first_point[s + 1];
    to.position.insert(to.position.end(), from.position.begin() + 3 * first,
                       from.position.begin() + 3 * end);
    to.first_point.push_back(to.first_point.back() + (end - first));
    to.radius.push_back(from.radius[s]);
    to.id.push_back(from.id[s]);
}

}  // namespace

Result<DifferenceImage> draw_difference(const Subject& a, const Subject& b,
                                        const DifferenceOptions& options) {
    DifferenceImage result;
    std::unordered_map<std::uint32_t, std::size_t> in_a;
    for (std::size_t s = 0; s < a.hair.id.size(); ++s) in_a.emplace(a.hair.id[s], s);
    SubjectStrands shown;
    std::vector<float> distance;  // [points]; < 0: only in a, -2: only in b
    constexpr float only_a = -1, only_b = -2;
    for (std::size_t s = 0; s < b.hair.id.size(); ++s) {
        const std::uint32_t points = b.hair.first_point[s + 1] - b.hair.first_point[s];
        if (points == 0) continue;
        const auto found = in_a.find(b.hair.id[s]);
        const bool matched = found != in_a.end() && a.hair.first_point[found->second + 1] >
                                                        a.hair.first_point[found->second];
        append(b.hair, s, shown);
        for (std::uint32_t p = 0; p < points; ++p) {
            if (!matched) {
                distance.push_back(only_b);
                continue;
            }
            const float u = points > 1 ? float(p) / float(points - 1) : 0;
            const float d = length(load(b.hair.position, b.hair.first_point[s] + p) -
                                   at_share(a.hair, found->second, u));
            distance.push_back(d);
            result.largest = std::max(result.largest, d);
        }
        if (matched)
            in_a.erase(found);
        else
            ++result.only_b;
    }
    for (std::size_t s = 0; s < a.hair.id.size(); ++s) {
        const auto found = in_a.find(a.hair.id[s]);
        if (found == in_a.end() || found->second != s) continue;
        append(a.hair, s, shown);
        distance.insert(distance.end(), a.hair.first_point[s + 1] - a.hair.first_point[s], only_a);
        ++result.only_a;
    }

    const float full = options.full > 0 ? options.full : result.largest;
    std::vector<Float3> color;
    for (const float d : distance)
        color.push_back(d == only_a   ? kOnlyA
                        : d == only_b ? kOnlyB
                        : d == 0      ? kSame
                                      : ramp_color(full > 0 ? d / full : 0));
    const RenderSettings& render_settings = options.render;
    Framing framing(options.angles, render_settings.width, render_settings.height);
    framing.include(shown.position);
    const Camera camera = framing.camera();
    std::vector<float> radius(color.size());
    for (std::size_t s = 0; s < shown.id.size(); ++s)
        std::fill(radius.begin() + shown.first_point[s], radius.begin() + shown.first_point[s + 1],
                  shown.radius[s]);
    const DrawnRadii radii =
        widen(shown.position, radius, camera, render_settings.height, kMinPixels);
    const StrandCurves curves{shown.first_point, shown.position,      radii.radius, color,
                              HairShading::flat, CurveShape::straight};
    std::vector<Surface> bodies;
    for (const BodyMesh& body : b.bodies) bodies.push_back({body.position, body.triangle, kBody});
    auto image = render({&curves, 1}, bodies, camera, render_settings);
    if (!image) return image.error();
    result.image = std::move(*image);

    const int scale = result.image.width >= 600 ? 2 : 1, line = 12 * scale;
    int y = 8;
    const auto say = [&](const char* text, Float3 c) {
        paste(make_image(8 * scale, 8 * scale, {to_srgb(c.x), to_srgb(c.y), to_srgb(c.z)}), 8, y,
              result.image);
        draw_text(text, 8 + 12 * scale, y, scale, {20, 20, 20}, result.image);
        y += line;
    };
    char text[96];
    say("same place", kSame);
    std::snprintf(text, sizeof text, "%.3g mm apart", 1000 * full);
    if (result.largest > 0) say(text, ramp_color(1));
    std::snprintf(text, sizeof text, "%zu strands only in the first", result.only_a);
    if (result.only_a > 0) say(text, kOnlyA);
    std::snprintf(text, sizeof text, "%zu strands only in the second", result.only_b);
    if (result.only_b > 0) say(text, kOnlyB);
    return result;
}

Result<DifferenceImage> draw_difference(const AssetView& a, const AssetView& b,
                                        const DifferenceOptions& options) {
    return draw_difference(rest_subject(a), rest_subject(b), options);
}

}  // namespace keratin::view
