#include "tools/keratin-view/ray_scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace keratin::view {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

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
void add_strands(RTCDevice device, RTCScene scene, const StrandCurves& strands, Part& part) {
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
    part.segment_point.resize(segments);
    part.segment_end.resize(segments);
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
            part.segment_point[segment] = p;
            part.segment_end[segment] =
                std::uint8_t((p == first ? kFirstSegment : 0) | (p + 1 == last ? kLastSegment : 0));
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

void add_triangles(RTCDevice device, RTCScene scene, std::span<const float> position,
                   std::span<const std::uint32_t> triangle) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertex = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), position.size() / 3);
    void* index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), triangle.size() / 3);
    if (vertex && index) {
        std::memcpy(vertex, position.data(), position.size_bytes());
        std::memcpy(index, triangle.data(), triangle.size_bytes());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
    }
    rtcReleaseGeometry(geometry);
}

template <class Ray>
void aim(Ray& ray, Float3 origin, Float3 direction, float near, float far) {
    ray.org_x = origin.x, ray.org_y = origin.y, ray.org_z = origin.z;
    ray.dir_x = direction.x, ray.dir_y = direction.y, ray.dir_z = direction.z;
    ray.tnear = near;
    ray.tfar = far;
    ray.mask = 0xffffffffu;
}

}  // namespace

Result<RayScene> RayScene::build(std::span<const StrandCurves> strands,
                                 std::span<const Surface> surfaces, bool ground) {
    RayScene scene;
    // One builder thread: one tree for one input.
    scene.device_ = rtcNewDevice("threads=1");
    if (!scene.device_) return Error{ErrorCode::internal, "", "Embree does not start"};
    std::string trouble;
    rtcSetDeviceErrorFunction(
        scene.device_,
        [](void* text, RTCError, const char* message) {
            *static_cast<std::string*>(text) = message;
        },
        &trouble);
    for (RTCScene* handle : {&scene.solid_, &scene.translucent_}) {
        *handle = rtcNewScene(scene.device_);
        rtcSetSceneFlags(*handle, RTC_SCENE_FLAG_ROBUST);
    }

    Float3 low{kInfinity, kInfinity, kInfinity}, high = -low;
    const auto include = [&](std::span<const float> position) {
        for (std::size_t i = 0; i < position.size() / 3; ++i) {
            const Float3 p = load(position, i);
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
    };
    for (const StrandCurves& s : strands) {
        include(s.position);
        Part part;
        part.strands = &s;
        add_strands(scene.device_, scene.solid_, s, part);
        if (part.segment_point.empty()) continue;
        part.hair.resize(s.color.size());
        for (std::size_t i = 0; i < s.color.size(); ++i)
            part.hair[i] =
                i > 0 && s.color[i] == s.color[i - 1] ? part.hair[i - 1] : hair_color(s.color[i]);
        scene.solid_parts_.push_back(std::move(part));
    }
    for (const Surface& s : surfaces) {
        if (s.triangle.empty()) continue;
        include(s.position);
        Part part;
        part.surface = &s;
        if (s.normals == Normals::smooth) part.normal = smooth_normals(s);
        const bool solid = s.opacity >= 1;
        add_triangles(scene.device_, solid ? scene.solid_ : scene.translucent_, s.position,
                      s.triangle);
        (solid ? scene.solid_parts_ : scene.translucent_parts_).push_back(std::move(part));
    }
    const bool any = low.x <= high.x;
    if (any) scene.reach_ = std::max(length(high - low), 1e-3f);
    if (ground && any) {
        const Float3 middle = (low + high) * 0.5f;
        const float r = 40 * scene.reach_, y = low.y - 1e-3f * scene.reach_;
        const float position[] = {middle.x - r, y, middle.z - r, middle.x - r, y, middle.z + r,
                                  middle.x + r, y, middle.z + r, middle.x + r, y, middle.z - r};
        const std::uint32_t triangle[] = {0, 1, 2, 0, 2, 3};
        add_triangles(scene.device_, scene.solid_, position, triangle);
        scene.solid_parts_.emplace_back();
    }
    rtcCommitScene(scene.solid_);
    rtcCommitScene(scene.translucent_);
    rtcSetDeviceErrorFunction(scene.device_, nullptr, nullptr);
    if (!trouble.empty()) return Error{ErrorCode::internal, "", "Embree: " + trouble};
    return scene;
}

RayScene::RayScene(RayScene&& other) noexcept
    : device_(std::exchange(other.device_, nullptr)),
      solid_(std::exchange(other.solid_, nullptr)),
      translucent_(std::exchange(other.translucent_, nullptr)),
      solid_parts_(std::move(other.solid_parts_)),
      translucent_parts_(std::move(other.translucent_parts_)),
      reach_(other.reach_) {}

RayScene::~RayScene() {
    if (solid_) rtcReleaseScene(solid_);
    if (translucent_) rtcReleaseScene(translucent_);
    if (device_) rtcReleaseDevice(device_);
}

RayHit RayScene::nearest(RTCScene scene, const std::vector<Part>& parts, Float3 origin,
                         Float3 direction, float near, float far) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    RTCRayHit ray{};
    aim(ray.ray, origin, direction, near, far);
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &ray);
    RayHit hit;
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
    hit.part = &parts[ray.hit.geomID];
    hit.distance = ray.ray.tfar;
    hit.position = origin + direction * hit.distance;
    hit.normal = {ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z};
    hit.primitive = ray.hit.primID;
    hit.u = ray.hit.u;
    hit.v = ray.hit.v;
    return hit;
}

RayHit RayScene::solid(Float3 origin, Float3 direction) const {
    return nearest(solid_, solid_parts_, origin, direction, 0, kInfinity);
}
RayHit RayScene::translucent(Float3 origin, Float3 direction, float near, float far) const {
    if (translucent_parts_.empty()) return {};
    return nearest(translucent_, translucent_parts_, origin, direction, near, far);
}

Passage RayScene::passage(Float3 origin, Float3 direction, float near, int enough) const {
    ShadowContext shadow{};
    rtcInitIntersectContext(&shadow.context);
    shadow.enough = enough;
    RTCRay ray{};
    aim(ray, origin, direction, near, kInfinity);
    rtcOccluded1(solid_, &shadow.context, &ray);
    return {ray.tfar < 0, shadow.hairs};
}

}  // namespace keratin::view
