#include "tools/keratin-view/hair_shading.h"

#include <array>
#include <cmath>
#include <numbers>

namespace keratin::view {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kLobes = 3;  // R, TT, TRT; a fourth gathers the rest

float sqr(float x) { return x * x; }
float safe_sqrt(float x) { return std::sqrt(std::max(0.0f, x)); }
float safe_asin(float x) { return std::asin(std::clamp(x, -1.0f, 1.0f)); }

// Modified Bessel function of the first kind, order 0.
float bessel_i0(float x) {
    float sum = 0, term = 1;
    for (int i = 1; i < 10; ++i) {
        sum += term;
        term *= sqr(x / (2 * i));
    }
    return sum;
}
float log_bessel_i0(float x) {
    if (x > 12) return x + 0.5f * (-std::log(2 * kPi) + std::log(1 / x) + 1 / (8 * x));
    return std::log(bessel_i0(x));
}

// Longitudinal scattering with variance v, d'Eon et al. 2011 eq. 7; for small v in logarithms.
float longitudinal(float cos_i, float cos_o, float sin_i, float sin_o, float v) {
    const float a = cos_i * cos_o / v, b = sin_i * sin_o / v;
    if (v <= 0.1f) return std::exp(log_bessel_i0(a) - b - 1 / v + 0.6931f + std::log(1 / (2 * v)));
    return std::exp(-b) * bessel_i0(a) / (std::sinh(1 / v) * 2 * v);
}

float logistic(float x, float s) {
    x = std::abs(x);
    const float e = std::exp(-x / s);
    return e / (s * sqr(1 + e));
}
float logistic_cdf(float x, float s) { return 1 / (1 + std::exp(-x / s)); }

// Azimuthal scattering around the lobe's direction, Chiang et al. 2016 eq. 5.
float azimuthal(float phi, int lobe, float s, float gamma_o, float gamma_t) {
    float d = phi - (2 * lobe * gamma_t - 2 * gamma_o + lobe * kPi);
    d = std::remainder(d, 2 * kPi);
    return logistic(d, s) / (logistic_cdf(kPi, s) - logistic_cdf(-kPi, s));
}

float fresnel(float cos_i, float eta) {
    cos_i = std::clamp(cos_i, 0.0f, 1.0f);
    const float sin_t = safe_sqrt(1 - sqr(cos_i)) / eta;
    if (sin_t >= 1) return 1;
    const float cos_t = safe_sqrt(1 - sqr(sin_t));
    const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    const float normal = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return 0.5f * (sqr(parallel) + sqr(normal));
}

// Chiang et al. 2016 eq. 9: absorption = (log(color) / scale)^2.
float color_scale(const HairSurface& surface) {
    const float b = surface.azimuthal_roughness;
    return 5.969f - 0.215f * b + 2.532f * sqr(b) - 10.73f * b * sqr(b) + 5.574f * sqr(sqr(b)) +
           0.245f * b * sqr(sqr(b));
}

Float3 exp3(Float3 a) { return {std::exp(a.x), std::exp(a.y), std::exp(a.z)}; }

}  // namespace

HairColor hair_color(Float3 color, const HairSurface& surface) {
    const float scale = color_scale(surface);
    const auto absorb = [&](float c) {
        return sqr(std::log(std::clamp(c, 1e-4f, 0.999f)) / scale);
    };
    return {color, {absorb(color.x), absorb(color.y), absorb(color.z)}};
}

Float3 marschner(const HairColor& hair, const HairSurface& surface, Float3 tangent, float offset,
                 Float3 to_eye, Float3 to_light) {
    const float eta = surface.refraction;
    const float sin_o = std::clamp(dot(tangent, to_eye), -1.0f, 1.0f),
                cos_o = safe_sqrt(1 - sqr(sin_o));
    const float sin_i = std::clamp(dot(tangent, to_light), -1.0f, 1.0f),
                cos_i = safe_sqrt(1 - sqr(sin_i));

    // Angle around the hair from the eye to the light.
    const Float3 eye_across = normalized(to_eye - tangent * sin_o);
    const Float3 light_across = to_light - tangent * sin_i;
    const float phi =
        std::atan2(dot(light_across, cross(tangent, eye_across)), dot(light_across, eye_across));

    offset = std::clamp(offset, -1.0f, 1.0f);
    const float gamma_o = safe_asin(offset);
    const float eta_p = safe_sqrt(sqr(eta) - sqr(sin_o)) / std::max(cos_o, 1e-3f);
    const float sin_gamma_t = std::clamp(offset / eta_p, -1.0f, 1.0f);
    const float gamma_t = safe_asin(sin_gamma_t);
    const float cos_theta_t = safe_sqrt(1 - sqr(sin_o / eta));

    // Attenuation of each lobe, Chiang et al. 2016 eqs. 12-14.
    const float f = fresnel(cos_o * safe_sqrt(1 - sqr(offset)), eta);
    const Float3 through = exp3(
        hair.absorption * (-2 * safe_sqrt(1 - sqr(sin_gamma_t)) / std::max(cos_theta_t, 1e-3f)));
    std::array<Float3, kLobes + 1> attenuation;
    attenuation[0] = {f, f, f};
    attenuation[1] = through * sqr(1 - f);
    attenuation[2] = attenuation[1] * through * f;
    const auto rest = [&](float a, float t) { return a * f * t / (1 - t * f); };
    attenuation[3] = {rest(attenuation[2].x, through.x), rest(attenuation[2].y, through.y),
                      rest(attenuation[2].z, through.z)};

    // Variances and widths from roughness, Chiang et al. 2016 eqs. 7 and 8.
    const float m = surface.longitudinal_roughness, n = surface.azimuthal_roughness;
    const float v = sqr(0.726f * m + 0.812f * sqr(m) + 3.7f * std::pow(m, 20.0f));
    const std::array<float, kLobes + 1> variance{v, v / 4, 4 * v, 4 * v};
    const float s =
        std::sqrt(kPi / 8) * (0.265f * n + 1.194f * sqr(n) + 5.372f * std::pow(n, 22.0f));

    const float tilt = surface.scale_tilt_deg * kPi / 180;
    const std::array<float, kLobes> tilts{2 * tilt, -tilt, -4 * tilt};

    Float3 sum;
    for (int lobe = 0; lobe < kLobes; ++lobe) {
        const float st = std::sin(tilts[lobe]), ct = std::cos(tilts[lobe]);
        const float sin_tilted = sin_o * ct - cos_o * st;
        const float cos_tilted = std::abs(cos_o * ct + sin_o * st);
        sum += attenuation[lobe] *
               (longitudinal(cos_i, cos_tilted, sin_i, sin_tilted, variance[lobe]) *
                azimuthal(phi, lobe, s, gamma_o, gamma_t));
    }
    sum += attenuation[kLobes] *
           (longitudinal(cos_i, cos_o, sin_i, sin_o, variance[kLobes]) / (2 * kPi));
    return sum;
}

Float3 kajiya_kay(const HairColor& hair, Float3 tangent, Float3 to_eye, Float3 to_light) {
    const float sin_i = std::clamp(dot(tangent, to_light), -1.0f, 1.0f),
                cos_i = safe_sqrt(1 - sqr(sin_i));
    const float sin_o = std::clamp(dot(tangent, to_eye), -1.0f, 1.0f),
                cos_o = safe_sqrt(1 - sqr(sin_o));
    constexpr float diffuse = 0.25f, highlight = 0.12f, exponent = 40;
    const float mirrored = std::max(0.0f, cos_i * cos_o - sin_i * sin_o);
    const float shine = highlight * std::pow(mirrored, exponent);
    return hair.color * (diffuse * cos_i) + Float3{shine, shine, shine};
}

}  // namespace keratin::view
