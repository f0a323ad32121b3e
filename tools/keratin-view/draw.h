// From a subject to a picture: which parts are shown, their colours and widths.
#pragma once

#include "tools/keratin-view/camera.h"
#include "tools/keratin-view/image.h"
#include "tools/keratin-view/render.h"
#include "tools/keratin-view/subject.h"

#include <optional>
#include <string>

namespace keratin::view {

enum class HairColoring {
    natural,   // hair_color, varied from strand to strand
    strand,    // a colour for each strand's id
    density,   // of the hair on a grid of voxels (voxels.h)
    velocity,  // likewise
    texture    // the texture at the root's uv
};

struct DrawOptions {
    RenderSettings render;
    HairColoring coloring = HairColoring::natural;
    Float3 hair_color{0.1f, 0.05f, 0.02f};  // linear
    std::optional<Image> texture;
    HairShading shading = HairShading::marschner;
    CurveShape shape = CurveShape::smooth;
    float min_pixels = 1.5f;  // strands are drawn at least as wide
    bool show_hair = true, show_guides = false, show_mesh = true, show_colliders = false;
    // Value with the brightest colour: m/s for velocity, the subject's density_unit for density.
    float color_full = 1;
    std::string caption;  // in the top left corner; empty: none
};

struct Drawn {
    Image image;
    std::size_t strands = 0, points = 0, guides = 0, triangles = 0;
    std::size_t widened_points = 0;  // that were thinner than min_pixels
    float largest_widening = 1;
};

// Errors: those of render; input when the subject lacks what the colours need, with what to do.
Result<Drawn> draw(const Subject& subject, const Camera& camera, const DrawOptions& options);

// Shows an automatic camera what it shall see of a subject: hair and guides if shown and any,
// otherwise the mesh and colliders; with `everything` all that is shown (planes, being endless,
// never).
void include_shown(const Subject& subject, const DrawOptions& options, bool everything,
                   Framing& framing);

// The value that 98 % of the points stay under, of what `coloring` shows; 0 when there is none.
float usual_largest(const Subject& subject, HairColoring coloring);

}  // namespace keratin::view
