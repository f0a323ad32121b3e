#include "tools/keratin-view/draw.h"

#include "tools/keratin-view/collider_mesh.h"
#include "tools/keratin-view/color.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <limits>

namespace keratin::view {
namespace {

constexpr Float3 kSkin{0.55f, 0.42f, 0.35f}, kColliderColor{0.10f, 0.30f, 0.65f};
constexpr float kColliderOpacity = 0.45f;
constexpr float kGuideWidening = 2;  // guides stand out from the hair

Float3 load(const std::vector<float>& values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

Result<std::vector<Float3>> hair_colors(const SubjectStrands& hair, const DrawOptions& options) {
    std::vector<Float3> color(hair.position.size() / 3);
    const std::size_t strands = hair.first_point.size() - 1;
    const auto each_strand = [&](auto&& color_of) {
        for (std::size_t s = 0; s < strands; ++s)
            std::fill(color.begin() + hair.first_point[s], color.begin() + hair.first_point[s + 1],
                      color_of(s));
    };
    switch (options.coloring) {
        case HairColoring::natural:
            each_strand(
                [&](std::size_t s) { return vary_hair_color(options.hair_color, hair.id[s]); });
            break;
        case HairColoring::strand:
            each_strand([&](std::size_t s) { return strand_color(hair.id[s]); });
            break;
        case HairColoring::texture:
            if (hair.uv.empty() || !options.texture)
                return Error{ErrorCode::input, "--color texture",
                             "the asset has no texture coordinates at its roots; bake it with a "
                             "mesh that has some"};
            each_strand([&](std::size_t s) {
                return vary_hair_color(
                    texture_color(*options.texture, hair.uv[2 * s], hair.uv[2 * s + 1]),
                    hair.id[s]);
            });
            break;
        case HairColoring::density:
            if (hair.density.size() != color.size())
                return Error{ErrorCode::input, "--color density",
                             "the subject was given no density"};
            for (std::size_t i = 0; i < color.size(); ++i)
                color[i] = ramp_color(hair.density[i] / options.color_full);
            break;
        case HairColoring::velocity:
            if (hair.velocity.size() != hair.position.size())
                return Error{ErrorCode::input, "--color velocity",
                             "there is no velocity here; draw a cached run (keratin-run --cache "
                             "run.kcache)"};
            for (std::size_t i = 0; i < color.size(); ++i)
                color[i] = velocity_color(load(hair.velocity, i), options.color_full);
            break;
    }
    return color;
}

std::vector<float> point_radii(const SubjectStrands& strands) {
    std::vector<float> radius(strands.position.size() / 3);
    for (std::size_t s = 0; s + 1 < strands.first_point.size(); ++s)
        std::fill(radius.begin() + strands.first_point[s],
                  radius.begin() + strands.first_point[s + 1], strands.radius[s]);
    return radius;
}

// Diagonal of the box around the hair, or around the bodies where there is none; 1 m for nothing.
float size_of(const Subject& subject) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    Float3 low{infinity, infinity, infinity}, high = -low;
    const auto include = [&](const std::vector<float>& position) {
        for (std::size_t i = 0; i < position.size() / 3; ++i) {
            const Float3 p = load(position, i);
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
    };
    include(subject.hair.position);
    if (low.x > high.x)
        for (const BodyMesh& body : subject.bodies) include(body.position);
    return low.x > high.x ? 1 : length(high - low);
}

// What the colours mean, in the lower left corner.
void draw_legend(const Subject& subject, const DrawOptions& options, Image& image) {
    const int scale = image.width >= 600 ? 2 : 1, line = 12 * scale;
    char text[128];
    if (options.coloring == HairColoring::density) {
        std::snprintf(text, sizeof text, "density 0 .. %.3g %s", options.color_full,
                      subject.density_unit.c_str());
        for (int x = 0; x < 160 * scale; ++x) {
            const Float3 c = ramp_color(float(x) / float(160 * scale));
            paste(make_image(1, 6 * scale, {to_srgb(c.x), to_srgb(c.y), to_srgb(c.z)}), 8 + x,
                  image.height - 2 * line, image);
        }
    } else if (options.coloring == HairColoring::velocity) {
        std::snprintf(text, sizeof text, "velocity: colour = direction, full from %.3g m/s",
                      options.color_full);
        int x = 8;
        const std::pair<const char*, Float3> axes[] = {{"+x", {1, 0, 0}}, {"-x", {-1, 0, 0}},
                                                       {"+z", {0, 0, 1}}, {"-z", {0, 0, -1}},
                                                       {"up", {0, 1, 0}}, {"down", {0, -1, 0}}};
        for (const auto& [name, direction] : axes) {
            const Float3 c = velocity_color(direction, 1);
            paste(make_image(8 * scale, 8 * scale, {to_srgb(c.x), to_srgb(c.y), to_srgb(c.z)}), x,
                  image.height - 2 * line, image);
            draw_text(name, x + 10 * scale, image.height - 2 * line, scale, {20, 20, 20}, image);
            x += 34 * scale;
        }
    } else {
        return;
    }
    draw_text(text, 8, image.height - line, scale, {20, 20, 20}, image);
}

}  // namespace

Result<Drawn> draw(const Subject& subject, const Camera& camera, const DrawOptions& options) {
    Drawn drawn;
    std::vector<StrandCurves> curves;
    DrawnRadii hair_radii, guide_radii;
    std::vector<Float3> hair_color, guide_color;
    const bool meaningful = options.coloring == HairColoring::strand ||
                            options.coloring == HairColoring::density ||
                            options.coloring == HairColoring::velocity;
    const int height = options.render.height;
    const auto count = [&](const DrawnRadii& radii) {
        drawn.widened_points += radii.widened;
        drawn.largest_widening = std::max(drawn.largest_widening, radii.largest_factor);
    };
    if (options.show_hair) {
        auto colors = hair_colors(subject.hair, options);
        if (!colors) return colors.error();
        hair_color = std::move(*colors);
        hair_radii = widen(subject.hair.position, point_radii(subject.hair), camera, height,
                           options.min_pixels);
        count(hair_radii);
        curves.push_back({subject.hair.first_point, subject.hair.position, hair_radii.radius,
                          hair_color, meaningful ? HairShading::flat : options.shading,
                          options.shape});
        drawn.strands = subject.hair.id.size();
        drawn.points = hair_color.size();
    }
    if (options.show_guides) {
        guide_radii = widen(subject.guides.position, point_radii(subject.guides), camera, height,
                            kGuideWidening * options.min_pixels);
        count(guide_radii);
        for (std::size_t s = 0; s < subject.guides.id.size(); ++s)
            guide_color.insert(guide_color.end(),
                               subject.guides.first_point[s + 1] - subject.guides.first_point[s],
                               strand_color(subject.guides.id[s]));
        curves.push_back({subject.guides.first_point, subject.guides.position, guide_radii.radius,
                          guide_color, HairShading::flat, options.shape});
        drawn.guides = subject.guides.id.size();
    }
    std::vector<Surface> surfaces;
    std::deque<BodyMesh> collider_meshes;
    if (options.show_mesh)
        for (const BodyMesh& body : subject.bodies)
            surfaces.push_back({body.position, body.triangle, kSkin});
    if (options.show_colliders) {
        const float reach = 2 * size_of(subject);
        for (const CacheCollider& collider : subject.colliders) {
            const BodyMesh& mesh = collider_meshes.emplace_back(collider_mesh(collider, reach));
            const bool round =
                collider.shape == CacheShape::sphere || collider.shape == CacheShape::capsule;
            surfaces.push_back({mesh.position, mesh.triangle, kColliderColor, kColliderOpacity,
                                round ? Normals::smooth : Normals::flat});
        }
    }
    for (const Surface& surface : surfaces) drawn.triangles += surface.triangle.size() / 3;

    auto image = render(curves, surfaces, camera, options.render);
    if (!image) return image.error();
    drawn.image = std::move(*image);
    draw_legend(subject, options, drawn.image);
    if (!options.caption.empty())
        draw_text(options.caption, 8, 8, drawn.image.width >= 400 ? 2 : 1, {20, 20, 20},
                  drawn.image);
    return drawn;
}

void include_shown(const Subject& subject, const DrawOptions& options, bool everything,
                   Framing& framing) {
    bool any = false;
    const auto include = [&](const std::vector<float>& position) {
        framing.include(position);
        any = any || !position.empty();
    };
    if (options.show_hair) include(subject.hair.position);
    if (options.show_guides) include(subject.guides.position);
    if (!everything && any) return;
    if (options.show_mesh)
        for (const BodyMesh& body : subject.bodies) include(body.position);
    if (options.show_colliders)
        for (const CacheCollider& collider : subject.colliders)
            if (collider.shape != CacheShape::plane) include(collider_mesh(collider, 0).position);
}

float usual_largest(const Subject& subject, HairColoring coloring) {
    std::vector<float> values;
    if (coloring == HairColoring::density) values = subject.hair.density;
    if (coloring == HairColoring::velocity)
        for (std::size_t i = 0; i < subject.hair.velocity.size() / 3; ++i)
            values.push_back(length(load(subject.hair.velocity, i)));
    if (values.empty()) return 0;
    const auto at = values.begin() + std::ptrdiff_t(0.98 * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

}  // namespace keratin::view
