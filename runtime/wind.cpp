// Wind as the small steps see it: gusts over time, waves over space; both fixed by the seed.
#include "runtime/formula/wind.h"

#include "runtime/state.h"

#include <cmath>

namespace keratin {

namespace {

// splitmix64 (Steele et al. 2014): the same numbers everywhere.
double uniform(std::uint64_t& state) {
    state += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    z ^= z >> 31;
    return double(z >> 11) * 0x1p-53;
}

// Turns per second of the three swellings that make up a gust.
constexpr double kGustRate[3] = {0.13, 0.31, 0.71};
// Wave lengths of the turbulence run from the first to the last of these, m.
constexpr double kLongestWave = 0.8, kShortestWave = 0.12;

double wave(double turns) { return wave_at(Vec3d(0, 0, 0), Vec3d(0, 0, 0), turns); }

}  // namespace

void make_wind(Simulation::State& s) {
    std::uint64_t state = s.settings.seed;
    for (double& phase : s.gust_phase) phase = uniform(state);
    for (int w = 0; w < kWindWaves; ++w) {
        const double size =
            kLongestWave * std::pow(kShortestWave / kLongestWave, double(w) / (kWindWaves - 1));
        Vec3d k(uniform(state) - 0.5, uniform(state) - 0.5, uniform(state) - 0.5);
        k = normalize_or(k, Vec3d(0, 0, 1)) * (1 / size);
        const Vec3d other(uniform(state) - 0.5, uniform(state) - 0.5, uniform(state) - 0.5);
        // Across its own direction of travel, as in a flow that does not pile up air.
        const Vec3d d = normalize_or(cross(k, other), Vec3d(1, 0, 0));
        Simulation::State::Wave& out = s.waves[w];
        out.k[0] = k.x, out.k[1] = k.y, out.k[2] = k.z;
        out.direction[0] = d.x, out.direction[1] = d.y, out.direction[2] = d.z;
        out.phase = uniform(state);
    }
}

void wind_at(const Simulation::State& s, double time, SmallStep& step) {
    const Wind& wind = s.settings.wind;
    double gust = 0;
    for (int i = 0; i < 3; ++i) gust += wave(kGustRate[i] * time + s.gust_phase[i]) / 3;
    const double swell = 1 + double(wind.gust) * gust;
    double speed = 0;
    for (int c = 0; c < 3; ++c) {
        step.wind[c] = float(wind.velocity[c] * swell);
        speed += double(wind.velocity[c]) * wind.velocity[c];
    }
    speed = std::sqrt(speed);
    const double strength = double(wind.turbulence) * speed * swell / std::sqrt(double(kWindWaves));
    for (int w = 0; w < kWindWaves; ++w) {
        const Simulation::State::Wave& in = s.waves[w];
        double travelled = 0, origin = 0;
        for (int c = 0; c < 3; ++c) {
            travelled += in.k[c] * wind.velocity[c] * time;
            origin += in.k[c] * s.settings.origin[c];
            step.wave[w].k[c] = float(in.k[c]);
            step.wave[w].direction[c] = float(in.direction[c] * strength);
        }
        const double turns = in.phase - travelled + origin;
        step.wave[w].phase = float(turns - std::floor(turns));
    }
}

}  // namespace keratin
