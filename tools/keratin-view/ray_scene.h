// Everything in a picture as Embree's geometry, and the two questions asked of it: what does a ray
// from the eye hit, and what stands between a point and a light.
#pragma once

#include "schema/result.h"
#include "tools/keratin-view/hair_shading.h"
#include "tools/keratin-view/render.h"

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

struct RTCDeviceTy;
struct RTCSceneTy;

namespace keratin::view {

// One geometry, and how a hit on it leads back to what it was made from.
struct Part {
    const StrandCurves* strands = nullptr;     // either strands,
    const Surface* surface = nullptr;          // or a surface, or neither: the ground
    std::vector<std::uint32_t> segment_point;  // strands: first of the two points of a primitive
    std::vector<std::uint8_t> segment_end;     // strands: kFirstSegment | kLastSegment
    std::vector<HairColor> hair;               // strands: per point
    std::vector<Float3> normal;                // smooth surface: per vertex
};
inline constexpr std::uint8_t kFirstSegment = 1, kLastSegment = 2;

struct RayHit {
    const Part* part = nullptr;  // null: nothing is hit
    float distance = 0;          // along the unit direction, m
    Float3 position, normal;     // m; not normalised, on either side
    std::uint32_t primitive = 0;
    float u = 0, v = 0;  // along a segment; barycentrics of a triangle
};

struct Passage {
    bool blocked = false;  // by a surface, or by as many hairs as were asked for
    int hairs = 0;         // on the way
};

// Translucent surfaces are kept apart: they throw no shadow.
class RayScene {
  public:
    // The strands and surfaces must outlive the scene. Error internal with Embree's own words.
    static Result<RayScene> build(std::span<const StrandCurves> strands,
                                  std::span<const Surface> surfaces, bool ground);
    RayScene(RayScene&& other) noexcept;
    RayScene& operator=(RayScene&&) = delete;
    ~RayScene();

    // Nearest hit on what is opaque, and nearest hit on what is translucent between two distances.
    RayHit solid(Float3 origin, Float3 direction) const;
    RayHit translucent(Float3 origin, Float3 direction, float near, float far) const;
    // From `near` on along the direction; stops at a surface or after `enough` hairs.
    Passage passage(Float3 origin, Float3 direction, float near, int enough) const;
    // Diagonal of the box around everything, m, at least 1e-3: scale of the offsets that keep a
    // surface from shading itself.
    float reach() const { return reach_; }

  private:
    RayScene() = default;
    RayHit nearest(RTCSceneTy* scene, const std::vector<Part>& parts, Float3 origin,
                   Float3 direction, float near, float far) const;

    RTCDeviceTy* device_ = nullptr;
    RTCSceneTy *solid_ = nullptr, *translucent_ = nullptr;
    std::vector<Part> solid_parts_, translucent_parts_;  // by geometry number
    float reach_ = 1;
};

}  // namespace keratin::view
