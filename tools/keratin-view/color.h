// Colours of strands: hair as it grows, and colours that mean something. Linear light.
#pragma once

#include "schema/result.h"
#include "tools/keratin-view/float3.h"
#include "tools/keratin-view/image.h"

#include <cstdint>
#include <string>

namespace keratin::view {

// black | dark | brown | auburn | red | blond | grey | white, or #rrggbb (sRGB). Errors (usage).
Result<Float3> parse_hair_color(const std::string& text);

// No two hairs are alike: `color`, a little lighter or darker and warmer or cooler by the strand's
// id.
Float3 vary_hair_color(Float3 color, std::uint32_t strand_id);

// A strong colour for each id, neighbouring ids far apart.
Float3 strand_color(std::uint32_t strand_id);

// From dark blue (0) over green to yellow (1), lighter all the way: numbers keep their order also
// in grey and for the colour-blind (five stops of matplotlib's viridis).
Float3 ramp_color(float value);

// A velocity as a colour: its direction as hue around the vertical axis, lighter upwards and darker
// downwards, grey at rest, full colour from `full` m/s on.
Float3 velocity_color(Float3 velocity, float full);

// The texture at (u, v), nearest pixel, repeating; v = 0 is the lowest row.
Float3 texture_color(const Image& texture, float u, float v);

}  // namespace keratin::view
