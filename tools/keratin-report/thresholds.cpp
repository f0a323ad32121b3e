// Families that look for the parameter at which a shape loses its stability: the strand is brought to
// rest without a disturbance, disturbed, and brought to rest again.
#include "tools/keratin-report/case.h"

#include <algorithm>

namespace keratin::report {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Relative width to which a threshold is found.
constexpr double kWidth = 2e-5;
// A disturbed strand has buckled when it stays further away than this share of its length.
constexpr double kAway = 3e-3;
// Ranges that are searched for a threshold, one beside the other, at most.
constexpr int kShifts = 8;

// Largest distance of each strand's points from where they were.
std::vector<double> moved(const RodSimulation& rods, const std::vector<std::vector<Double3>>& before) {
    std::vector<double> out;
    for (std::size_t s = 0; s < before.size(); ++s) {
        double worst = 0;
        for (std::size_t i = 0; i < before[s].size(); ++i)
            worst = std::max(worst, distance(rods.position(s, i), before[s][i]));
        out.push_back(worst);
    }
    return out;
}

// Disturbs strands at rest by `size` (m) and says which of them go away.
std::vector<bool> leave(RodSimulation& rods, const std::vector<double>& lengths, double size) {
    std::vector<std::vector<Double3>> before;
    for (std::size_t s = 0; s < lengths.size(); ++s) before.push_back(rods.points(s));
    rods.settle({.tolerance = 1e-8 * lengths[0], .perturbation = size});
    const std::vector<double> far = moved(rods, before);
    std::vector<bool> out;
    for (std::size_t s = 0; s < lengths.size(); ++s) out.push_back(far[s] > kAway * lengths[s]);
    return out;
}

// Clamped pointing down, natural curvature in one plane, raised from none: out of the plane?
std::vector<bool> curl_leaves_plane(const Json& test, std::size_t edges, const std::vector<double>& curvatures) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    RodStrand strand = straight_strand(edges, length, {0, -1, 0});
    strand.material = material_of(setup);
    strand.root_frame = {Double3{0, -1, 0}, Double3{1, 0, 0}};
    RodSimulation rods = make_rods(std::vector<RodStrand>(curvatures.size(), strand), settings_of(setup));
    constexpr int kRamp = 12;
    for (int k = 1; k <= kRamp; ++k) {
        for (std::size_t s = 0; s < curvatures.size(); ++s)
            (void)rods.set_natural_curvature(s, {0, curvatures[s] * k / kRamp}, 0);
        rods.settle({.tolerance = 1e-8 * length});
    }
    return leave(rods, std::vector<double>(curvatures.size(), length), 1e-4 * length);
}

// Strands of different lengths, straight at first.
RodSimulation strands_of(const Json& test, std::size_t edges, const std::vector<double>& lengths,
                         const Double3& direction, const Double3& normal) {
    const Json& setup = test.at("setup");
    std::vector<RodStrand> strands;
    for (const double length : lengths) {
        RodStrand strand = straight_strand(edges, length, direction);
        strand.material = material_of(setup);
        if (setup.contains("semi_axis_vertical_m"))
            strand.material.radii = {setup.at("semi_axis_vertical_m").get<double>(),
                                     setup.at("semi_axis_horizontal_m").get<double>()};
        strand.root_frame = {direction, normal};
        strands.push_back(strand);
    }
    return make_rods(strands, settings_of(setup));
}

// Clamped horizontally with the long axis of its section upright: sideways?
std::vector<bool> ribbon_tips(const Json& test, std::size_t edges, const std::vector<double>& lengths) {
    RodSimulation rods = strands_of(test, edges, lengths, {1, 0, 0}, {0, 1, 0});
    rods.settle({.tolerance = 1e-8 * lengths[0]});
    return leave(rods, lengths, 1e-4 * lengths[0]);
}

// Clamped upright: over?
std::vector<bool> column_falls(const Json& test, std::size_t edges, const std::vector<double>& lengths) {
    RodSimulation rods = strands_of(test, edges, lengths, {0, 1, 0}, {1, 0, 0});
    rods.settle({.tolerance = 1e-8 * lengths[0]});
    return leave(rods, lengths, 1e-5 * lengths[0]);
}

// A straight rod bent to a closed ring and twisted by turning one end: out of its plane? The cut is
// held, which takes no more from the ring than its freedom to move as a whole.
std::vector<bool> ring_writhes(const Json& test, std::size_t edges, const std::vector<double>& twists) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    RodStrand strand;
    strand.rest_points = straight_strand(edges, length, {1, 0, 0}).points;
    const double radius = length / static_cast<double>(edges) / (2 * std::sin(kPi / static_cast<double>(edges)));
    for (std::size_t i = 0; i <= edges; ++i) {
        const double phi = 2 * kPi * static_cast<double>(i % edges) / static_cast<double>(edges);
        strand.points.push_back({radius * std::sin(phi), radius * (1 - std::cos(phi)), 0});
    }
    strand.natural_curvature = {{0, 0}};
    strand.material = material_of(setup);
    strand.root = strand.tip = RodEnd::clamped;
    strand.root_frame = strand.tip_frame = {Double3{1, 0, 0}, Double3{0, 0, 1}};
    RodSimulation rods = make_rods(std::vector<RodStrand>(twists.size(), strand), settings_of(setup));
    rods.settle({.tolerance = 1e-8 * length});
    constexpr int kTurns = 16;
    for (int k = 0; k < kTurns; ++k) {
        for (std::size_t s = 0; s < twists.size(); ++s)
            (void)rods.move_tip(s, {.position = rods.position(s, edges), .turn = {twists[s] / kTurns, 0, 0}});
        rods.settle({.tolerance = 1e-8 * length});
    }
    // it snaps through itself to a ring with two turns less, so it is its twist that tells
    std::vector<bool> out = leave(rods, std::vector<double>(twists.size(), length), 1e-4 * length);
    for (std::size_t s = 0; s < twists.size(); ++s)
        out[s] = out[s] || std::abs(rods.twist(s) - twists[s]) > 1;
    return out;
}

// Finds the threshold at each resolution; the first bracket comes from a scan, the others from the
// result before.
std::vector<Check> thresholds(const Json& test, Buckled buckled, const char* what, double reference, double low,
                              double high, double step) {
    std::vector<Check> checks;
    std::pair<double, double> bracket = bracket_threshold(test, 20, buckled, low, high, step);
    for (const auto& [edges, tolerance] : resolutions(test.at("tolerance"))) {
        double found = std::nan("");
        if (!std::isnan(bracket.first)) {
            // the coarse mesh's bracket may lie beside the fine one's threshold: what is found at an
            // end of the range is looked for on that side
            const double middle = (bracket.first + bracket.second) / 2, reach = std::max(0.06 * middle, step);
            double from = middle - reach, to = middle + reach;
            for (int k = 0; k < kShifts; ++k) {
                found = find_threshold(test, edges, buckled, from, to, kWidth);
                const double end = 3 * kWidth * found;
                const double shift = found - from < end ? -reach : to - found < end ? reach : 0;
                if (shift == 0) break;
                from += shift;
                to += shift;
                found = std::nan("");
            }
            if (!std::isnan(found)) bracket = {found, found};
        }
        checks.push_back({at(what, edges), found, reference, relative(found, reference), tolerance});
    }
    return checks;
}

double length_of(const Json& test) { return test.at("setup").at("length_m").get<double>(); }

}  // namespace

std::vector<Check> run_bend_twist(const Json& test) {
    const double length = length_of(test);
    return thresholds(test, curl_leaves_plane, "critical curvature (1/m)",
                      test.at("reference").at("kappa_n_critical_per_m").get<double>(), 0.5 / length, 25 / length,
                      0.5 / length);
}

std::vector<Check> run_lateral_buckling(const Json& test) {
    const Json& setup = test.at("setup");
    // from a quarter of the length at which q = w L^3/sqrt(B_out C) is that of a narrow ribbon
    const double r1 = setup.at("semi_axis_vertical_m").get<double>(), r2 = setup.at("semi_axis_horizontal_m").get<double>();
    const double weight = setup.at("density_kg_m3").get<double>() * kPi * r1 * r2 * setup.at("gravity_m_s2").get<double>();
    const double scale = std::cbrt(std::sqrt(setup.at("B_out_N_m2").get<double>() * setup.at("C_N_m2").get<double>()) / weight);
    return thresholds(test, ribbon_tips, "critical length (m)", test.at("reference").at("L_crit_m").get<double>(), scale,
                      4 * scale, 0.1 * scale);
}

std::vector<Check> run_greenhill(const Json& test) {
    const Json& setup = test.at("setup");
    const RodMaterial m = material_of(setup);
    const double r = m.radii[0];
    const double scale = std::cbrt(m.youngs_modulus * r * r / 4 / (m.density * setup.at("gravity_m_s2").get<double>()));
    return thresholds(test, column_falls, "critical length (m)", test.at("reference").at("L_crit_m").get<double>(), scale,
                      4 * scale, 0.1 * scale);
}

std::vector<Check> run_michell_ring(const Json& test) {
    return thresholds(test, ring_writhes, "critical twist (rad)",
                      test.at("reference").at("total_twist_crit_rad").get<double>(), 4, 40, 1);
}

}  // namespace keratin::report
