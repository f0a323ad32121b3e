// How much light a hair sends from one direction into another.
//
// Directions are unit vectors that point away from the hair; `tangent` is the unit direction of the
// hair from root to tip. Results are the scattered share per steradian times the cosine at which
// the light meets the hair: multiply by the light's radiance. `color` is the colour of a thick tuft
// of such hair under white light, linear, 0..1.
#pragma once

#include "tools/keratin-view/float3.h"

namespace keratin::view {

struct HairSurface {
    float longitudinal_roughness = 0.30f;  // 0..1, spread of the highlights along the hair
    float azimuthal_roughness = 0.35f;     // 0..1, spread around the hair
    float scale_tilt_deg = 2.0f;           // tilt of the cuticle's scales
    float refraction = 1.55f;              // index of keratin
};

// What depends on the hair's colour alone, made once a strand.
struct HairColor {
    Float3 color;
    Float3 absorption;  // per hair radius
};
HairColor hair_color(Float3 color, const HairSurface& surface = {});

// Marschner et al. 2003, "Light scattering from human hair fibers": lobes R, TT, TRT and what is
// left, with the energy-conserving longitudinal term of d'Eon et al. 2011 and the near-field
// azimuthal term and colour mapping of Chiang et al. 2016, "A practical and controllable hair and
// fur model".
//   offset  -1..1, where the ray to the eye crosses the hair: 0 through its axis, +-1 at its rim,
//           positive towards cross(tangent, to_eye)
Float3 marschner(const HairColor& hair, const HairSurface& surface, Float3 tangent, float offset,
                 Float3 to_eye, Float3 to_light);

// Kajiya & Kay 1989, "Rendering fur with three dimensional textures": a diffuse term by the sine
// between light and hair, and a highlight on the mirrored cone.
Float3 kajiya_kay(const HairColor& hair, Float3 tangent, Float3 to_eye, Float3 to_light);

}  // namespace keratin::view
