// A picture: 8 bits a channel, sRGB, rows from top to bottom, three bytes a pixel without padding.
#pragma once

#include "schema/result.h"
#include "tools/keratin-view/float3.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace keratin::view {

struct Image {
    int width = 0, height = 0;      // pixels
    std::vector<std::uint8_t> rgb;  // [height][width][3]

    std::array<std::uint8_t, 3> at(int x, int y) const {
        const std::size_t i = 3 * (std::size_t(y) * width + x);
        return {rgb[i], rgb[i + 1], rgb[i + 2]};
    }
};

Image make_image(int width, int height, std::array<std::uint8_t, 3> color);

// Linear light (0..1, clamped) to and from the sRGB transfer function.
std::uint8_t to_srgb(float linear);
float from_srgb(std::uint8_t value);

// Writes a PNG to a temporary file beside `path` and renames it. Errors: io.
Result<void> write_png(const Image& image, const std::string& path);
// Reads a PNG or JPEG. Errors: io when it cannot be read, input when it is no picture.
Result<Image> read_image(const std::string& path);

// Copies `part` into `image` with its top left corner at (x, y); what lies outside is cut off.
void paste(const Image& part, int x, int y, Image& image);
// Writes text with its top left corner at (x, y): letters 7 pixels high times `scale`.
void draw_text(const std::string& text, int x, int y, int scale, std::array<std::uint8_t, 3> color,
               Image& image);

// Several pictures of one size as one, row by row, with `columns` in a row; 0: so many that the
// sheet is about as wide as high. The largest side stays below `largest_side` by drawing every
// picture smaller (whole-number box filter).
Image contact_sheet(const std::vector<Image>& pictures, int columns = 0, int largest_side = 4096);

}  // namespace keratin::view
