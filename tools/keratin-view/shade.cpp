#include "tools/keratin-view/shade.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace keratin::view {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Light that passes a hair on its way is weakened, not stopped: this share goes on, more of it in
// the hair's own colour. After kOpaqueHairs nothing is left to see.
constexpr float kPassed = 0.38f, kPassedTint = 0.96f;
constexpr int kOpaqueHairs = 8;
constexpr float kSkyPassed = 0.08f, kSkyPassedTint = 0.25f;

Float3 load(std::span<const float> values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

Float3 sky(const Rig& rig, Float3 direction) {
    return mix(rig.sky_bottom, rig.sky_top, 0.5f + 0.5f * direction.y);
}

// What is left of a lamp's light of colour 1 at hair or skin of colour `tint`: 0 behind a surface,
// weakened by each hair.
Float3 passed_light(const RayScene& scene, Float3 origin, Float3 direction, float near,
                    Float3 tint) {
    const Passage passage = scene.passage(origin, direction, near, kOpaqueHairs);
    if (passage.blocked) return {0, 0, 0};
    if (passage.hairs == 0) return {1, 1, 1};
    const auto weaken = [&](float c) {
        return std::pow(kPassed + (kPassedTint - kPassed) * c, float(passage.hairs));
    };
    return {weaken(tint.x), weaken(tint.y), weaken(tint.z)};
}
// The same of the sky, which shines from everywhere: the first hair on the way decides.
Float3 passed_sky(const RayScene& scene, Float3 origin, Float3 direction, float near, Float3 tint) {
    const Passage passage = scene.passage(origin, direction, near, 1);
    if (passage.hairs > 0)
        return Float3{kSkyPassed, kSkyPassed, kSkyPassed} + tint * kSkyPassedTint;
    return passage.blocked ? Float3{0, 0, 0} : Float3{1, 1, 1};
}

struct SurfaceNormals {
    Float3 smooth, flat;  // unit, on the eye's side
};
SurfaceNormals surface_normals(const RayHit& hit, Float3 to_eye) {
    SurfaceNormals normals;
    normals.flat = normalized(hit.normal);
    if (dot(normals.flat, to_eye) < 0) normals.flat = -normals.flat;
    const std::vector<Float3>& at = hit.part->normal;
    if (!at.empty()) {
        const std::uint32_t* v = &hit.part->surface->triangle[3 * hit.primitive];
        normals.smooth =
            normalized(at[v[0]] * (1 - hit.u - hit.v) + at[v[1]] * hit.u + at[v[2]] * hit.v);
        if (dot(normals.smooth, normals.flat) < 0) normals.smooth = -normals.smooth;
    }
    if (normals.smooth == Float3{}) normals.smooth = normals.flat;
    return normals;
}

}  // namespace

Rig make_rig(const CameraAxes& axes) {
    const Float3 back = -axes.forward;
    const Float3 up{0, 1, 0};
    return {
        {normalized(axes.right * -0.75f + up * 0.95f + back * 0.85f), {3.1f, 2.95f, 2.75f}, 0.06f},
        {normalized(axes.right * 0.8f + up * 0.75f - back * 0.9f), {1.3f, 1.4f, 1.5f}, 0.10f},
        {0.95f, 1.0f, 1.08f},
        {0.42f, 0.40f, 0.38f}};
}

Float3 shade_hair(const RayScene& scene, const Rig& rig, const RayHit& hit, Float3 to_eye,
                  const Randoms& random) {
    const StrandCurves& strands = *hit.part->strands;
    const std::uint32_t p = hit.part->segment_point[hit.primitive];
    const std::uint8_t end = hit.part->segment_end[hit.primitive];
    const float u = hit.u;
    const Float3 p1 = load(strands.position, p), p2 = load(strands.position, p + 1);
    Float3 tangent = p2 - p1;
    if (strands.shape == CurveShape::smooth) {
        const Float3 p0 = end & kFirstSegment ? 2 * p1 - p2 : load(strands.position, p - 1);
        const Float3 p3 = end & kLastSegment ? 2 * p2 - p1 : load(strands.position, p + 2);
        tangent = (p2 - p0) + (2 * u) * (2 * p0 - 5 * p1 + 4 * p2 - p3) +
                  (3 * u * u) * (3 * p1 - p0 - 3 * p2 + p3);
    }
    tangent = normalized(tangent);
    const Float3 across = normalized(to_eye - tangent * dot(tangent, to_eye));
    const Float3 normal = normalized(hit.normal - tangent * dot(tangent, hit.normal));
    const float offset = dot(normal, cross(tangent, across));
    const HairColor &hair0 = hit.part->hair[p], &hair1 = hit.part->hair[p + 1];
    const HairColor hair{mix(hair0.color, hair1.color, u),
                         mix(hair0.absorption, hair1.absorption, u)};
    const float radius = strands.radius[p] + u * (strands.radius[p + 1] - strands.radius[p]);
    const float near = 2 * radius + 1e-5f * scene.reach();

    if (strands.shading == HairShading::flat) {
        const Float3 white{0, 0, 0};
        const Float3 key = passed_light(scene, hit.position, rig.key.toward, near, white);
        const float lit = std::sqrt(
            std::max(0.0f, 1 - dot(tangent, rig.key.toward) * dot(tangent, rig.key.toward)));
        return hair.color * (0.55f + 0.45f * lit * key.x);
    }
    const HairSurface surface;
    Float3 sum;
    const auto add = [&](const Light& light, float weight, Pair pair) {
        const Float3 toward = disc_direction(light.toward, light.spread, pair);
        const Float3 scattered = strands.shading == HairShading::marschner
                                     ? marschner(hair, surface, tangent, offset, to_eye, toward)
                                     : kajiya_kay(hair, tangent, to_eye, toward);
        // Light scattered many times between the hairs around has lost its direction.
        const float sine =
            std::sqrt(std::max(0.0f, 1 - dot(tangent, toward) * dot(tangent, toward)));
        const Float3 spread = hair.color * (0.16f * sine);
        const Float3 passed = passed_light(scene, hit.position, toward, near, hair.color);
        sum += light.radiance * weight * passed * (scattered + spread);
    };
    add(rig.key, 1, random.key);
    if (random.odd) {
        add(rig.rim, 2, random.other);
    } else {
        const Float3 open = sine_direction(tangent, across, random.other);
        sum += hair.color * sky(rig, open) *
               passed_sky(scene, hit.position, open, near, hair.color) * (2 * 0.8f);
    }
    return sum;
}

Float3 shade_surface(const RayScene& scene, const Rig& rig, const RayHit& hit, Float3 to_eye,
                     const Randoms& random) {
    const Surface& surface = *hit.part->surface;
    const auto [normal, flat] = surface_normals(hit, to_eye);
    const float near = 1e-4f * scene.reach();
    const Float3 origin = hit.position + flat * (1e-4f * scene.reach());
    const Float3 black{0, 0, 0};
    Float3 sum;
    const auto add = [&](const Light& light, Pair pair) {
        const Float3 toward = disc_direction(light.toward, light.spread, pair);
        const float cosine = dot(normal, toward);
        if (cosine <= 0 || dot(flat, toward) <= 0) return;
        const Float3 half = normalized(toward + to_eye);
        const float shine = 0.035f * std::pow(std::max(0.0f, dot(normal, half)), 24.0f);
        const Float3 passed = passed_light(scene, origin, toward, near, black);
        sum += light.radiance * passed *
               (surface.color * (cosine / kPi) + Float3{shine, shine, shine} * cosine);
    };
    add(rig.key, random.key);
    add(rig.rim, random.other);
    const Float3 open = cosine_direction(normal, random.other);
    if (dot(open, flat) > 0)
        sum += surface.color * sky(rig, open) * passed_sky(scene, origin, open, near, black);
    return sum;
}

Float3 shade_translucent(const Rig& rig, const RayHit& hit, Float3 to_eye) {
    const Float3 normal = surface_normals(hit, to_eye).smooth;
    const Float3 lamp = rig.key.radiance * (std::max(0.0f, dot(normal, rig.key.toward)) / kPi);
    return hit.part->surface->color * (lamp + sky(rig, normal));
}

float shade_ground(const RayScene& scene, const Rig& rig, const RayHit& hit,
                   const Randoms& random) {
    const Float3 up{0, 1, 0}, black{0, 0, 0};
    const float near = 1e-4f * scene.reach();
    const Float3 toward = disc_direction(rig.key.toward, rig.key.spread, random.key);
    const float key = passed_light(scene, hit.position, toward, near, black).x;
    const float open =
        passed_light(scene, hit.position, cosine_direction(up, random.other), near, black).x;
    return 0.45f * key + 0.55f * open;
}

}  // namespace keratin::view
