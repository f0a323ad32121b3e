#include "tools/keratin-view/image.h"

#include "schema/files/write_file.h"

#include <algorithm>
#include <cmath>
#include <span>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_easy_font.h>
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace keratin::view {

Image make_image(int width, int height, std::array<std::uint8_t, 3> color) {
    Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 3)};
    for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = color[i % 3];
    return image;
}

std::uint8_t to_srgb(float linear) {
    const float c = std::clamp(linear, 0.0f, 1.0f);
    const float s = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
    return std::uint8_t(255 * s + 0.5f);
}
float from_srgb(std::uint8_t value) {
    const float s = value / 255.0f;
    return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}

Result<void> write_png(const Image& image, const std::string& path) {
    std::vector<char> bytes;
    const auto append = [](void* to, void* data, int size) {
        auto& out = *static_cast<std::vector<char>*>(to);
        out.insert(out.end(), static_cast<char*>(data), static_cast<char*>(data) + size);
    };
    if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, 3, image.rgb.data(),
                                3 * image.width))
        return Error{ErrorCode::internal, path, "the picture cannot be packed as PNG"};
    return write_file(path, std::as_bytes(std::span<const char>(bytes)));
}

Result<Image> read_image(const std::string& path) {
    const auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    Image image;
    int channels = 0;
    stbi_uc* data =
        stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(bytes->data()), int(bytes->size()),
                              &image.width, &image.height, &channels, 3);
    if (!data)
        return Error{ErrorCode::input, path,
                     std::string("is no PNG or JPEG picture: ") + stbi_failure_reason()};
    image.rgb.assign(data, data + std::size_t(image.width) * image.height * 3);
    stbi_image_free(data);
    return image;
}

void paste(const Image& part, int x, int y, Image& image) {
    const int left = std::max(0, x), right = std::min(image.width, x + part.width);
    if (left >= right) return;
    for (int row = std::max(0, y); row < std::min(image.height, y + part.height); ++row)
        std::copy_n(&part.rgb[3 * (std::size_t(row - y) * part.width + (left - x))],
                    3 * (right - left), &image.rgb[3 * (std::size_t(row) * image.width + left)]);
}

void draw_text(const std::string& text, int x, int y, int scale, std::array<std::uint8_t, 3> color,
               Image& image) {
    // stb_easy_font writes axis-aligned rectangles: four corners of x, y, z (float) and a colour (4
    // bytes).
    struct Corner {
        float x, y, z;
        std::uint32_t color;
    };
    std::vector<Corner> corners(4 * 64 * (text.size() + 1));
    std::string copy = text;
    const int count = stb_easy_font_print(0, 0, copy.data(), nullptr, corners.data(),
                                          int(corners.size() * sizeof(Corner)));
    for (int q = 0; q < count; ++q) {
        const Corner &a = corners[4 * q], &b = corners[4 * q + 2];
        for (int py = y + int(a.y) * scale; py < y + int(b.y) * scale; ++py)
            for (int px = x + int(a.x) * scale; px < x + int(b.x) * scale; ++px)
                if (px >= 0 && py >= 0 && px < image.width && py < image.height)
                    std::copy(color.begin(), color.end(),
                              &image.rgb[3 * (std::size_t(py) * image.width + px)]);
    }
}

Image contact_sheet(const std::vector<Image>& pictures, int columns, int largest_side) {
    if (pictures.empty()) return make_image(1, 1, {0, 0, 0});
    const int width = pictures[0].width, height = pictures[0].height, count = int(pictures.size());
    if (columns > 0) {
        columns = std::min(columns, count);
    } else {
        columns = 1;
        while (columns < count && columns * width < ((count + columns - 1) / columns) * height)
            ++columns;
    }
    const int rows = (count + columns - 1) / columns;
    int shrink = 1;
    while (columns * (width / shrink) > largest_side || rows * (height / shrink) > largest_side)
        ++shrink;
    const int w = width / shrink, h = height / shrink;
    constexpr int gap = 4;
    Image sheet = make_image(columns * (w + gap) + gap, rows * (h + gap) + gap, {24, 24, 24});
    for (int i = 0; i < count; ++i) {
        Image part = make_image(w, h, {0, 0, 0});
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x)
                for (int c = 0; c < 3; ++c) {
                    float sum = 0;
                    for (int sy = 0; sy < shrink; ++sy)
                        for (int sx = 0; sx < shrink; ++sx)
                            sum += from_srgb(pictures[i].at(x * shrink + sx, y * shrink + sy)[c]);
                    part.rgb[3 * (std::size_t(y) * w + x) + c] =
                        to_srgb(sum / float(shrink * shrink));
                }
        paste(part, gap + i % columns * (w + gap), gap + i / columns * (h + gap), sheet);
    }
    return sheet;
}

}  // namespace keratin::view
