#include "tools/keratin-report/case.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace keratin::report {

namespace {

constexpr std::pair<const char*, Family> kFamilies[] = {
    {"cantilever", run_cantilever},
    {"helix", run_helix},
    {"kirchhoff-3d", run_kirchhoff_3d},
    {"catenary", run_catenary},
    {"self-stretch", run_self_stretch},
    {"bend-twist", run_bend_twist},
    {"lateral-buckling", run_lateral_buckling},
    {"greenhill", run_greenhill},
    {"michell-ring", run_michell_ring},
    {"vibration", run_vibration},
    {"pendulum", run_pendulum},
    {"falling-hair", run_falling_hair},
    {"incline", run_incline},
    {"sliding-block", run_sliding_block},
    {"capstan", run_capstan},
    {"stick-slip", run_stick_slip},
    {"free-rod-contact", run_free_rod_contact},
    {"coulomb-residual", run_coulomb_residual},
};

constexpr std::size_t kTries = 7;

}  // namespace

std::vector<Resolution> resolutions(const Json& tolerance) {
    std::vector<Resolution> out;
    for (const auto& [key, value] : tolerance.items()) {
        if (key.size() < 2 || key[0] != 'N' || key.find_first_not_of("0123456789", 1) != std::string::npos)
            continue;
        out.push_back({static_cast<std::size_t>(std::stoul(key.substr(1))), value.get<double>()});
    }
    std::sort(out.begin(), out.end(), [](const Resolution& a, const Resolution& b) { return a.edges < b.edges; });
    return out;
}

RodStrand straight_strand(std::size_t edges, double length, const Double3& direction) {
    RodStrand s;
    for (std::size_t i = 0; i <= edges; ++i) {
        const double d = length * static_cast<double>(i) / static_cast<double>(edges);
        s.points.push_back({d * direction[0], d * direction[1], d * direction[2]});
    }
    return s;
}

RodMaterial material_of(const Json& setup) {
    RodMaterial m;
    if (setup.contains("radius_m")) m.radii = {setup.at("radius_m").get<double>(), setup.at("radius_m").get<double>()};
    if (setup.contains("E_Pa")) m.youngs_modulus = setup.at("E_Pa").get<double>();
    m.density = setup.value("density_kg_m3", setup.value("density", m.density));
    m.poisson_ratio = setup.value("poisson", 0.35);
    return m;
}

RodSettings settings_of(const Json& setup) {
    RodSettings s;
    s.gravity = {0, -setup.value("gravity_m_s2", 0.0), 0};
    s.threads = 1;
    return s;
}

std::string at(const char* what, std::size_t edges) {
    return std::string(what) + ", N " + std::to_string(edges);
}

double distance(const Double3& a, const Double3& b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return std::sqrt(x * x + y * y + z * z);
}

RodSimulation make_rods(const std::vector<RodStrand>& strands, const RodSettings& settings) {
    auto rods = RodSimulation::create(strands, settings);
    if (!rods) throw std::runtime_error(to_string(rods.error()));
    return std::move(*rods);
}

std::pair<double, double> bracket_threshold(const Json& test, std::size_t edges, Buckled buckled, double low,
                                            double high, double step) {
    for (double from = low; from < high; from += step * kTries) {
        std::vector<double> tries;
        for (std::size_t k = 1; k <= kTries; ++k) tries.push_back(from + step * static_cast<double>(k));
        const std::vector<bool> out = buckled(test, edges, tries);
        for (std::size_t k = 0; k < kTries; ++k)
            if (out[k]) return {tries[k] - step, tries[k]};
    }
    return {std::nan(""), std::nan("")};
}

double find_threshold(const Json& test, std::size_t edges, Buckled buckled, double low, double high, double width) {
    while (high - low > width * high) {
        std::vector<double> tries;
        for (std::size_t k = 1; k <= kTries; ++k)
            tries.push_back(low + (high - low) * static_cast<double>(k) / (kTries + 1));
        const std::vector<bool> out = buckled(test, edges, tries);
        std::size_t first = 0;
        while (first < kTries && !out[first]) ++first;
        const double below = first == 0 ? low : tries[first - 1];
        high = first == kTries ? high : tries[first];
        low = below;
    }
    return (low + high) / 2;
}

Family find_family(const std::string& name) {
    for (const auto& [known, run] : kFamilies)
        if (name == known) return run;
    return nullptr;
}

Outcome run_case(const Json& test) {
    Outcome out;
    out.id = test.at("id").get<std::string>();
    out.family = test.at("family").get<std::string>();
    const auto start = std::chrono::steady_clock::now();
    if (const Family run = find_family(out.family))
        out.checks = run(test);
    else
        out.not_applicable = "no test of this family is built for the rod solver";
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace keratin::report
