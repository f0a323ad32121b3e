#include "tools/keratin-view/render.h"

#include "tools/keratin-view/hair_shading.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <omp.h>
#include <string>

namespace keratin::view {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kMaxLayers = 64;  // translucent surfaces behind each other
constexpr int kMaxSide = 16384, kMaxSamples = 4096;

// Light that passes a hair on its way is weakened, not stopped: this share goes on, more of it in
// the hair's own colour. After kOpaqueHairs nothing is left to see.
constexpr float kPassed = 0.38f, kPassedTint = 0.96f;
constexpr int kOpaqueHairs = 8;
constexpr float kSkyPassed = 0.08f, kSkyPassedTint = 0.25f;

struct Light {
    Float3 toward;    // unit
    Float3 radiance;  // times the solid angle
    float spread;     // tangent of the half angle of the disc that the light comes from
};

// The lights stand around the camera: the key above its left shoulder, a rim light behind the
// object.
struct Rig {
    Light key, rim;
    Float3 sky_top, sky_bottom;
};
Rig make_rig(const CameraAxes& axes) {
    const Float3 back = -axes.forward;
    const Float3 up{0, 1, 0};
    return {
        {normalized(axes.right * -0.75f + up * 0.95f + back * 0.85f), {3.1f, 2.95f, 2.75f}, 0.06f},
        {normalized(axes.right * 0.8f + up * 0.75f - back * 0.9f), {1.3f, 1.4f, 1.5f}, 0.10f},
        {0.95f, 1.0f, 1.08f},
        {0.42f, 0.40f, 0.38f}};
}
Float3 sky(const Rig& rig, Float3 direction) {
    return mix(rig.sky_bottom, rig.sky_top, 0.5f + 0.5f * direction.y);
}

std::uint32_t hash(std::uint32_t x) {  // Wellons' lowbias32
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Two numbers in [0, 1) for a pixel, a sample of it and a purpose: the first two dimensions of
// Sobol's sequence, scrambled and shuffled for each pixel and purpose (Kollig & Keller 2002).
struct Pair {
    float a, b;
};
Pair sample_pair(std::uint32_t pixel, std::uint32_t sample, std::uint32_t purpose,
                 std::uint32_t sample_mask) {
    const std::uint32_t seed = hash(pixel * 8 + purpose);
    std::uint32_t a = hash(seed + 1), b = hash(seed + 2);
    std::uint32_t i = sample ^ (hash(seed + 3) & sample_mask);
    for (std::uint32_t va = 1u << 31, vb = 1u << 31; i; i >>= 1, va >>= 1, vb ^= vb >> 1)
        if (i & 1) a ^= va, b ^= vb;
    constexpr float to_unit = 1.0f / (1 << 24);
    return {(a >> 8) * to_unit, (b >> 8) * to_unit};
}

// Embree's objects, released when they go.
struct Device {
    RTCDevice handle = rtcNewDevice("threads=1");  // one builder thread: one tree for one input
    ~Device() { rtcReleaseDevice(handle); }
};
struct SceneHandle {
    RTCScene handle;
    ~SceneHandle() { rtcReleaseScene(handle); }
};

// What was hit is found again by the geometry's number.
struct Thing {
    const StrandCurves* strands = nullptr;
    std::vector<std::uint32_t> segment_point;  // strands: first of the two points of each primitive
    std::vector<std::uint32_t>
        segment_end;              // strands: 1 first, 2 last segment of its strand, as bits
    std::vector<HairColor> hair;  // strands: per point
    const Surface* surface = nullptr;
    std::vector<Float3> normal;  // surface: per vertex
    bool ground = false;
};

Float3 load(std::span<const float> values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

// Counts hairs on the way of a shadow ray and goes on until there are `enough`.
struct ShadowContext {
    RTCIntersectContext context;
    int hairs, enough;
};
void count_hair(const RTCFilterFunctionNArguments* args) {
    auto* shadow = reinterpret_cast<ShadowContext*>(args->context);
    if (++shadow->hairs < shadow->enough) args->valid[0] = 0;
}

// Smooth normals: area-weighted over the triangles around a place, whatever vertices share it.
std::vector<Float3> smooth_normals(const Surface& surface) {
    const std::size_t count = surface.position.size() / 3;
    std::vector<std::uint32_t> order(count), place(count);
    for (std::size_t i = 0; i < count; ++i) order[i] = std::uint32_t(i);
    const auto key = [&](std::uint32_t i) {
        const Float3 p = load(surface.position, i);
        return std::array{p.x, p.y, p.z};
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto ka = key(a), kb = key(b);
        return ka != kb ? ka < kb : a < b;
    });
    for (std::size_t i = 0; i < count; ++i)
        place[order[i]] =
            i > 0 && key(order[i]) == key(order[i - 1]) ? place[order[i - 1]] : order[i];
    std::vector<Float3> sum(count), normal(count);
    for (std::size_t t = 0; t + 2 < surface.triangle.size(); t += 3) {
        const auto* v = &surface.triangle[t];
        const Float3 a = load(surface.position, v[0]), b = load(surface.position, v[1]),
                     c = load(surface.position, v[2]);
        const Float3 n = cross(b - a, c - a);
        for (int k = 0; k < 3; ++k) sum[place[v[k]]] += n;
    }
    for (std::size_t i = 0; i < count; ++i) normal[i] = normalized(sum[place[i]]);
    return normal;
}

// The point before the first and after the last of a strand, for the spline: the end segment
// mirrored.
void add_strand_geometry(RTCDevice device, RTCScene scene, const StrandCurves& strands,
                         Thing& thing) {
    const bool smooth = strands.shape == CurveShape::smooth;
    std::size_t strand_points = 0, segments = 0, drawn = 0;
    const std::size_t strand_count =
        strands.first_point.empty() ? 0 : strands.first_point.size() - 1;
    for (std::size_t s = 0; s < strand_count; ++s) {
        const std::size_t n = strands.first_point[s + 1] - strands.first_point[s];
        if (n < 2) continue;
        ++drawn;
        strand_points += n;
        segments += n - 1;
    }
    if (segments == 0) return;
    RTCGeometry geometry = rtcNewGeometry(device, smooth ? RTC_GEOMETRY_TYPE_ROUND_CATMULL_ROM_CURVE
                                                         : RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
    const std::size_t vertices = strand_points + (smooth ? 2 * drawn : 0);
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), vertices));
    auto* index = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, sizeof(std::uint32_t), segments));
    auto* flags = smooth ? nullptr
                         : static_cast<std::uint8_t*>(rtcSetNewGeometryBuffer(
                               geometry, RTC_BUFFER_TYPE_FLAGS, 0, RTC_FORMAT_UCHAR, 1, segments));
    if (!vertex || !index || (!smooth && !flags)) {
        rtcReleaseGeometry(geometry);
        return;
    }
    std::uint32_t v = 0;
    std::size_t segment = 0;
    const auto put = [&](Float3 p, float r) {
        vertex[4 * v] = p.x, vertex[4 * v + 1] = p.y, vertex[4 * v + 2] = p.z,
                   vertex[4 * v + 3] = r;
        ++v;
    };
    thing.segment_point.resize(segments);
    thing.segment_end.resize(segments);
    for (std::size_t s = 0; s < strand_count; ++s) {
        const std::uint32_t first = strands.first_point[s], last = strands.first_point[s + 1] - 1;
        if (strands.first_point[s + 1] - first < 2) continue;
        const std::uint32_t first_vertex = v;
        if (smooth)
            put(2 * load(strands.position, first) - load(strands.position, first + 1),
                strands.radius[first]);
        for (std::uint32_t p = first; p <= last; ++p)
            put(load(strands.position, p), strands.radius[p]);
        if (smooth)
            put(2 * load(strands.position, last) - load(strands.position, last - 1),
                strands.radius[last]);
        for (std::uint32_t p = first; p < last; ++p, ++segment) {
            index[segment] = first_vertex + (p - first);
            thing.segment_point[segment] = p;
            thing.segment_end[segment] = (p == first ? 1u : 0u) | (p + 1 == last ? 2u : 0u);
            if (flags)
                flags[segment] = (p > first ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0) |
                                 (p + 1 < last ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : 0);
        }
    }
    rtcSetGeometryOccludedFilterFunction(geometry, count_hair);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

void let_pass(const RTCFilterFunctionNArguments* args) { args->valid[0] = 0; }

enum class Shadow { thrown, none };
void add_triangles(RTCDevice device, RTCScene scene, std::span<const float> position,
                   std::span<const std::uint32_t> triangle, Shadow shadow) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertex = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), position.size() / 3);
    void* index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), triangle.size() / 3);
    if (vertex && index) {
        std::memcpy(vertex, position.data(), position.size_bytes());
        std::memcpy(index, triangle.data(), triangle.size_bytes());
        if (shadow == Shadow::none) rtcSetGeometryOccludedFilterFunction(geometry, let_pass);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
    }
    rtcReleaseGeometry(geometry);
}

// Everything a ray needs, read-only while the picture is drawn.
struct World {
    RTCScene scene;
    std::span<const Thing> things;  // by geometry number
    Rig rig;
    float reach;  // m, size of everything: scale of the offsets against self-shadowing
};

struct Passage {
    bool blocked;  // by a surface, or by `enough` hairs
    int hairs;     // on the way, at most `enough`
};
Passage look(const World& world, Float3 origin, Float3 direction, float near, int enough) {
    ShadowContext shadow{};
    rtcInitIntersectContext(&shadow.context);
    shadow.enough = enough;
    RTCRay ray{};
    ray.org_x = origin.x, ray.org_y = origin.y, ray.org_z = origin.z;
    ray.dir_x = direction.x, ray.dir_y = direction.y, ray.dir_z = direction.z;
    ray.tnear = near;
    ray.tfar = kInfinity;
    ray.mask = 0xffffffffu;
    rtcOccluded1(world.scene, &shadow.context, &ray);
    return {ray.tfar < 0, shadow.hairs};
}

// What is left of a lamp's light of colour 1 at hair or skin of colour `tint`: 0 behind a surface,
// weakened by each hair.
Float3 passed_light(const World& world, Float3 origin, Float3 direction, float near, Float3 tint) {
    const Passage passage = look(world, origin, direction, near, kOpaqueHairs);
    if (passage.blocked) return {0, 0, 0};
    if (passage.hairs == 0) return {1, 1, 1};
    const auto weaken = [&](float c) {
        return std::pow(kPassed + (kPassedTint - kPassed) * c, float(passage.hairs));
    };
    return {weaken(tint.x), weaken(tint.y), weaken(tint.z)};
}
// The same of the sky, which shines from everywhere: the first hair on the way decides.
Float3 passed_sky(const World& world, Float3 origin, Float3 direction, float near, Float3 tint) {
    const Passage passage = look(world, origin, direction, near, 1);
    if (passage.hairs > 0)
        return Float3{kSkyPassed, kSkyPassed, kSkyPassed} + tint * kSkyPassedTint;
    return passage.blocked ? Float3{0, 0, 0} : Float3{1, 1, 1};
}

Float3 toward_light(const Light& light, Pair random) {
    const float r = light.spread * std::sqrt(random.a), phi = 2 * kPi * random.b;
    const Float3 s = perpendicular(light.toward), t = cross(light.toward, s);
    return normalized(light.toward + s * (r * std::cos(phi)) + t * (r * std::sin(phi)));
}

// A direction around `axis`: with the cosine to it (surfaces), or with the sine (hair: the light
// that a thin cylinder meets).
Float3 cosine_direction(Float3 axis, Pair random) {
    const float r = std::sqrt(random.a), phi = 2 * kPi * random.b;
    const Float3 s = perpendicular(axis), t = cross(axis, s);
    return s * (r * std::cos(phi)) + t * (r * std::sin(phi)) +
           axis * std::sqrt(std::max(0.0f, 1 - random.a));
}
Float3 around_direction(Float3 tangent, Float3 side, Pair random) {
    // Half of the sphere, on the side of `side`. The angle x to the tangent has density (2 / pi)
    // sin^2 x; its distribution (x - sin x cos x) / pi is inverted by a few Newton steps.
    float x = kPi * random.a;
    for (int k = 0; k < 4; ++k) {
        const float sine = std::sin(x);
        x -= (x - sine * std::cos(x) - kPi * random.a) / std::max(2 * sine * sine, 0.05f);
    }
    const float phi = kPi * (random.b - 0.5f);
    const Float3 t = cross(tangent, side);
    return tangent * std::cos(x) + (side * std::cos(phi) + t * std::sin(phi)) * std::sin(x);
}

struct HitPoint {
    Float3 position, normal, to_eye;
    std::uint32_t primitive;
    float u, v;
};
// Every sample asks the key light; on hair, by turns the rim light or the sky with twice the
// weight.
struct Randoms {
    Pair key, other;
    bool odd;
};

Float3 shade_hair(const World& world, const Thing& thing, const HitPoint& hit,
                  const Randoms& random) {
    const StrandCurves& strands = *thing.strands;
    const std::uint32_t p = thing.segment_point[hit.primitive],
                        end = thing.segment_end[hit.primitive];
    const float u = hit.u;
    const Float3 p1 = load(strands.position, p), p2 = load(strands.position, p + 1);
    Float3 tangent = p2 - p1;
    if (strands.shape == CurveShape::smooth) {
        const Float3 p0 = end & 1 ? 2 * p1 - p2 : load(strands.position, p - 1);
        const Float3 p3 = end & 2 ? 2 * p2 - p1 : load(strands.position, p + 2);
        tangent = (p2 - p0) + (2 * u) * (2 * p0 - 5 * p1 + 4 * p2 - p3) +
                  (3 * u * u) * (3 * p1 - p0 - 3 * p2 + p3);
    }
    tangent = normalized(tangent);
    const Float3 across = normalized(hit.to_eye - tangent * dot(tangent, hit.to_eye));
    const Float3 normal = normalized(hit.normal - tangent * dot(tangent, hit.normal));
    const float offset = dot(normal, cross(tangent, across));
    const HairColor &hair0 = thing.hair[p], &hair1 = thing.hair[p + 1];
    const HairColor hair{mix(hair0.color, hair1.color, u),
                         mix(hair0.absorption, hair1.absorption, u)};
    const float radius = strands.radius[p] + u * (strands.radius[p + 1] - strands.radius[p]);
    const float near = 2 * radius + 1e-5f * world.reach;

    if (strands.shading == HairShading::flat) {
        const Float3 white{0, 0, 0};
        const Float3 key = passed_light(world, hit.position, world.rig.key.toward, near, white);
        const float lit = std::sqrt(std::max(
            0.0f, 1 - dot(tangent, world.rig.key.toward) * dot(tangent, world.rig.key.toward)));
        return hair.color * (0.55f + 0.45f * lit * key.x);
    }
    const HairSurface surface;
    Float3 sum;
    const auto add = [&](const Light& light, float weight, Pair pair) {
        const Float3 toward = toward_light(light, pair);
        const Float3 scattered = strands.shading == HairShading::marschner
                                     ? marschner(hair, surface, tangent, offset, hit.to_eye, toward)
                                     : kajiya_kay(hair, tangent, hit.to_eye, toward);
        // Light scattered many times between the hairs around has lost its direction.
        const float sine =
            std::sqrt(std::max(0.0f, 1 - dot(tangent, toward) * dot(tangent, toward)));
        const Float3 spread = hair.color * (0.16f * sine);
        const Float3 passed = passed_light(world, hit.position, toward, near, hair.color);
        sum += light.radiance * weight * passed * (scattered + spread);
    };
    add(world.rig.key, 1, random.key);
    if (random.odd) {
        add(world.rig.rim, 2, random.other);
    } else {
        const Float3 open = around_direction(tangent, across, random.other);
        sum += hair.color * sky(world.rig, open) *
               passed_sky(world, hit.position, open, near, hair.color) * (2 * 0.8f);
    }
    return sum;
}

Float3 shade_surface(const World& world, const Thing& thing, const HitPoint& hit,
                     const Randoms& random) {
    const Surface& surface = *thing.surface;
    const std::uint32_t* v = &surface.triangle[3 * hit.primitive];
    Float3 normal;
    if (!thing.normal.empty())
        normal = normalized(thing.normal[v[0]] * (1 - hit.u - hit.v) + thing.normal[v[1]] * hit.u +
                            thing.normal[v[2]] * hit.v);
    Float3 flat = normalized(hit.normal);
    if (dot(flat, hit.to_eye) < 0) flat = -flat;
    if (dot(normal, flat) < 0) normal = -normal;
    if (normal == Float3{}) normal = flat;
    const float near = 1e-4f * world.reach;
    const Float3 origin = hit.position + flat * (1e-4f * world.reach);
    const Float3 black{0, 0, 0};
    Float3 sum;
    const auto add = [&](const Light& light, Pair pair) {
        const Float3 toward = toward_light(light, pair);
        const float cosine = dot(normal, toward);
        if (cosine <= 0 || dot(flat, toward) <= 0) return;
        const Float3 half = normalized(toward + hit.to_eye);
        const float shine = 0.035f * std::pow(std::max(0.0f, dot(normal, half)), 24.0f);
        const Float3 passed = passed_light(world, origin, toward, near, black);
        sum += light.radiance * passed *
               (surface.color * (cosine / kPi) + Float3{shine, shine, shine} * cosine);
    };
    add(world.rig.key, random.key);
    add(world.rig.rim, random.other);
    const Float3 open = cosine_direction(normal, random.other);
    if (dot(open, flat) > 0)
        sum += surface.color * sky(world.rig, open) * passed_sky(world, origin, open, near, black);
    return sum;
}

// A floor that shows the shadow only: 1 in full light.
float shade_ground(const World& world, const HitPoint& hit, const Randoms& random) {
    const Float3 up{0, 1, 0}, black{0, 0, 0};
    const float near = 1e-4f * world.reach;
    const Float3 toward = toward_light(world.rig.key, random.key);
    const float key = passed_light(world, hit.position, toward, near, black).x;
    const float open =
        passed_light(world, hit.position, cosine_direction(up, random.other), near, black).x;
    return 0.45f * key + 0.55f * open;
}

// Brightest parts are bent below white instead of cut off; the hue stays.
Float3 shoulder(Float3 light) {
    constexpr float knee = 0.6f;
    const float most = std::max({light.x, light.y, light.z});
    if (most <= knee) return light;
    return light * ((knee + (1 - knee) * (1 - std::exp(-(most - knee) / (1 - knee)))) / most);
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
        const float depth = dot(load(position, i) - camera.position, axes.forward);
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

    Device device;
    if (!device.handle) return Error{ErrorCode::internal, "", "Embree does not start"};
    std::string trouble;
    rtcSetDeviceErrorFunction(
        device.handle,
        [](void* text, RTCError, const char* message) {
            *static_cast<std::string*>(text) = message;
        },
        &trouble);
    SceneHandle scene{rtcNewScene(device.handle)};
    rtcSetSceneFlags(scene.handle, RTC_SCENE_FLAG_ROBUST);

    Float3 low{kInfinity, kInfinity, kInfinity}, high = -low;
    const auto include = [&](std::span<const float> position) {
        for (std::size_t i = 0; i < position.size() / 3; ++i) {
            const Float3 p = load(position, i);
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
    };
    std::vector<Thing> things;
    for (const StrandCurves& s : strands) {
        include(s.position);
        Thing thing;
        thing.strands = &s;
        add_strand_geometry(device.handle, scene.handle, s, thing);
        if (thing.segment_point.empty()) continue;
        thing.hair.resize(s.color.size());
        for (std::size_t i = 0; i < s.color.size(); ++i)
            thing.hair[i] =
                i > 0 && s.color[i] == s.color[i - 1] ? thing.hair[i - 1] : hair_color(s.color[i]);
        things.push_back(std::move(thing));
    }
    for (const Surface& s : surfaces) {
        if (s.triangle.empty()) continue;
        include(s.position);
        Thing thing;
        thing.surface = &s;
        if (s.normals == Normals::smooth) thing.normal = smooth_normals(s);
        add_triangles(device.handle, scene.handle, s.position, s.triangle,
                      s.opacity < 1 ? Shadow::none : Shadow::thrown);
        things.push_back(std::move(thing));
    }
    const float reach = low.x <= high.x ? std::max(length(high - low), 1e-3f) : 1;
    if (settings.ground && low.x <= high.x) {
        const Float3 middle = (low + high) * 0.5f;
        const float r = 40 * reach, y = low.y - 1e-3f * reach;
        const float position[] = {middle.x - r, y, middle.z - r, middle.x - r, y, middle.z + r,
                                  middle.x + r, y, middle.z + r, middle.x + r, y, middle.z - r};
        const std::uint32_t triangle[] = {0, 1, 2, 0, 2, 3};
        Thing thing;
        thing.ground = true;
        add_triangles(device.handle, scene.handle, position, triangle, Shadow::none);
        things.push_back(std::move(thing));
    }
    rtcCommitScene(scene.handle);
    if (!trouble.empty()) return Error{ErrorCode::internal, "", "Embree: " + trouble};

    const CameraAxes axes = camera_axes(camera);
    const World world{scene.handle, things, make_rig(axes), reach};
    const int width = settings.width, height = settings.height;
    const float pixel = pixel_size(camera, height, 1);
    std::uint32_t sample_mask = 1;
    while (sample_mask < std::uint32_t(settings.samples)) sample_mask *= 2;
    --sample_mask;

    const auto background = [&](float x, float y) {
        // A soft glow behind the middle of a gradient.
        const float dx = (x - 0.5f * width) / height, dy = (y - 0.55f * height) / height;
        const Float3 base = mix(settings.background_top, settings.background_bottom,
                                std::clamp(y / height, 0.0f, 1.0f));
        return base * (0.86f + 0.22f * std::exp(-2.5f * (dx * dx + dy * dy)));
    };

    const auto trace = [&](std::uint32_t pixel_number, int px, int py, std::uint32_t sample) {
        const Pair at = sample_pair(pixel_number, sample, 0, sample_mask);
        const auto tent = [](float u) {
            return u < 0.5f ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
        };
        const float x = px + 0.5f + tent(at.a), y = py + 0.5f + tent(at.b);
        const Float3 direction =
            normalized(axes.forward + axes.right * ((x - 0.5f * width) * pixel) +
                       axes.up * ((0.5f * height - y) * pixel));
        const auto shade = [&](const Thing& thing, const HitPoint& hit) {
            const Randoms random{sample_pair(pixel_number, sample, 1, sample_mask),
                                 thing.strands
                                     ? sample_pair(pixel_number, sample / 2, 2, sample_mask / 2)
                                     : sample_pair(pixel_number, sample, 2, sample_mask),
                                 ((sample ^ pixel_number ^ pixel_number / width) & 1) != 0};
            if (thing.ground) return background(x, y) * shade_ground(world, hit, random);
            return shoulder(thing.strands ? shade_hair(world, thing, hit, random)
                                          : shade_surface(world, thing, hit, random));
        };
        Float3 sum;
        float left = 1, near = 0;  // share of the picture that what is farther away still has
        for (int layer = 0; layer < kMaxLayers; ++layer) {
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
            RTCRayHit ray{};
            ray.ray.org_x = camera.position.x, ray.ray.org_y = camera.position.y,
            ray.ray.org_z = camera.position.z;
            ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
            ray.ray.tnear = near;
            ray.ray.tfar = kInfinity;
            ray.ray.mask = 0xffffffffu;
            ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(world.scene, &context, &ray);
            if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return sum + background(x, y) * left;
            const Thing& thing = world.things[ray.hit.geomID];
            const HitPoint hit{camera.position + direction * ray.ray.tfar,
                               {ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z},
                               -direction,
                               ray.hit.primID,
                               ray.hit.u,
                               ray.hit.v};
            const float opacity = thing.surface ? thing.surface->opacity : 1;
            sum += shade(thing, hit) * (left * opacity);
            left *= 1 - opacity;
            if (left <= 0) break;
            near = ray.ray.tfar * (1 + 1e-5f);
        }
        return sum;
    };

    Image image = make_image(width, height, {0, 0, 0});
    constexpr int tile = 16;  // pixels a side: rays of a tile meet the same part of the tree
    const int columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
#pragma omp parallel for schedule(dynamic) num_threads(threads_to_use(settings.threads))
    for (int t = 0; t < columns * rows; ++t)
        for (int py = t / columns * tile; py < std::min(height, (t / columns + 1) * tile); ++py)
            for (int px = t % columns * tile; px < std::min(width, (t % columns + 1) * tile);
                 ++px) {
                const std::uint32_t number = std::uint32_t(py) * width + px;
                Float3 sum;
                for (int s = 0; s < settings.samples; ++s) sum += trace(number, px, py, s);
                sum = sum * (1.0f / settings.samples);
                std::uint8_t* out = &image.rgb[3 * std::size_t(number)];
                out[0] = to_srgb(sum.x), out[1] = to_srgb(sum.y), out[2] = to_srgb(sum.z);
            }
    return image;
}

}  // namespace keratin::view
