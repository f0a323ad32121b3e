#include "tools/keratin-view/color.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>

namespace keratin::view {
namespace {

struct NamedColor {
    std::string_view name;
    std::uint32_t rgb;
};
constexpr auto kHairColors = std::to_array<NamedColor>({{"black", 0x1c1816},
                                                        {"dark", 0x38271d},
                                                        {"brown", 0x5c3d29},
                                                        {"auburn", 0x70351c},
                                                        {"red", 0x96491f},
                                                        {"blond", 0xb8945f},
                                                        {"grey", 0x8b8884},
                                                        {"white", 0xd9d4cc}});

Float3 from_rgb(std::uint32_t rgb) {
    return {from_srgb(std::uint8_t(rgb >> 16)), from_srgb(std::uint8_t(rgb >> 8)),
            from_srgb(std::uint8_t(rgb))};
}

// -1..1, even.
float scatter(std::uint32_t id, std::uint32_t salt) {
    std::uint32_t x = id * 0x9e3779b9u + salt;
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    x ^= x >> 16;
    return float(x >> 8) / (1 << 23) - 1;
}

Float3 from_hue(float hue, float saturation, float value) {
    const auto channel = [&](float shift) {
        const float k = std::fmod(hue * 6 + shift, 6.0f);
        return value * (1 - saturation * std::clamp(std::min(k, 4 - k), 0.0f, 1.0f));
    };
    return {channel(5), channel(3), channel(1)};
}

}  // namespace

Result<Float3> parse_hair_color(const std::string& text) {
    for (const NamedColor& c : kHairColors)
        if (text == c.name) return from_rgb(c.rgb);
    if (text.size() == 7 && text[0] == '#') {
        std::uint32_t rgb = 0;
        const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 7, rgb, 16);
        if (error == std::errc() && end == text.data() + 7) return from_rgb(rgb);
    }
    std::string names;
    for (const NamedColor& c : kHairColors) names += std::string(c.name) + ", ";
    return Error{ErrorCode::usage, "",
                 "'" + text + "' is no colour; it is " + names + "or #rrggbb"};
}

Float3 vary_hair_color(Float3 color, std::uint32_t strand_id) {
    constexpr float lightness = 0.45f, warmth = 0.12f;
    const float light =
        std::exp(lightness * scatter(strand_id, 1) * std::abs(scatter(strand_id, 2)));
    const float warm = std::exp(warmth * scatter(strand_id, 3));
    const auto limit = [](float c) { return std::min(c, 0.95f); };
    return {limit(color.x * light * warm), limit(color.y * light), limit(color.z * light / warm)};
}

Float3 strand_color(std::uint32_t strand_id) {
    // Steps of the golden ratio spread hues evenly however many there are.
    const float hue = float(double(strand_id) * std::numbers::phi -
                            std::floor(double(strand_id) * std::numbers::phi));
    return from_hue(hue, 0.75f + 0.15f * scatter(strand_id, 4),
                    0.75f + 0.2f * scatter(strand_id, 5));
}

Float3 ramp_color(float value) {
    constexpr std::array<std::uint32_t, 5> stops{0x440154, 0x3b528b, 0x21918c, 0x5ec962, 0xfde725};
    const float t = std::clamp(value, 0.0f, 1.0f) * (stops.size() - 1);
    const std::size_t i = std::min(std::size_t(t), stops.size() - 2);
    return mix(from_rgb(stops[i]), from_rgb(stops[i + 1]), t - float(i));
}

Float3 velocity_color(Float3 velocity, float full) {
    const float speed = length(velocity);
    if (!(speed > 0) || !(full > 0)) return {0.18f, 0.18f, 0.18f};
    const float strength = std::min(1.0f, speed / full);
    const float hue = std::atan2(velocity.z, velocity.x) / (2 * std::numbers::pi_v<float>)+1;
    const float level = 0.55f + 0.4f * velocity.y / speed;
    return mix({0.18f, 0.18f, 0.18f}, from_hue(hue, 0.85f, level), strength);
}

Float3 texture_color(const Image& texture, float u, float v) {
    const auto cell = [](float t, int count) {
        t -= std::floor(t);
        return std::min(int(t * count), count - 1);
    };
    const auto c = texture.at(cell(u, texture.width), texture.height - 1 - cell(v, texture.height));
    return {from_srgb(c[0]), from_srgb(c[1]), from_srgb(c[2])};
}

}  // namespace keratin::view
