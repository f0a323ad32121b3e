// The light that a hit point sends to the eye: lamps around the camera, sky, what stands between.
#pragma once

#include "tools/keratin-view/ray_scene.h"
#include "tools/keratin-view/sampling.h"

namespace keratin::view {

struct Light {
    Float3 toward;    // unit
    Float3 radiance;  // times the solid angle
    float spread;     // tangent of the half angle of the disc that the light comes from
};

// The lights stand around the camera: the key above its left shoulder, a rim light behind the
// object; the sky is lighter above.
struct Rig {
    Light key, rim;
    Float3 sky_top, sky_bottom;
};
Rig make_rig(const CameraAxes& axes);

// Every sample asks the key light; on hair, by turns the rim light or the sky with twice the
// weight.
struct Randoms {
    Pair key, other;
    bool odd;
};

// to_eye is the unit direction from the hit to the camera.
Float3 shade_hair(const RayScene& scene, const Rig& rig, const RayHit& hit, Float3 to_eye,
                  const Randoms& random);
Float3 shade_surface(const RayScene& scene, const Rig& rig, const RayHit& hit, Float3 to_eye,
                     const Randoms& random);
// Without shadows, for translucent surfaces, which may stand many deep.
Float3 shade_translucent(const Rig& rig, const RayHit& hit, Float3 to_eye);
// Light that reaches the ground, 1 where nothing stands in its way.
float shade_ground(const RayScene& scene, const Rig& rig, const RayHit& hit, const Randoms& random);

}  // namespace keratin::view
