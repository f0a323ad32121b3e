// Families that compare a shape at rest with its reference.
#include "tools/keratin-report/case.h"

#include <algorithm>
#include <regex>

namespace keratin::report {

namespace {

// Settled steps in which a natural curvature is brought on from a straight strand.
constexpr int kRamp = 15;

// Brings on natural curvature and twist (1/m) from none and lets the strand come to rest each time.
// `perturbation` (m): so that it leaves a plane in which it is not stable.
void ramp_curvature(RodSimulation& rods, const std::array<double, 3>& u, double length, double perturbation) {
    for (int k = 1; k <= kRamp; ++k) {
        const double share = static_cast<double>(k) / kRamp;
        (void)rods.set_natural_curvature(0, {share * u[0], share * u[1]}, share * u[2]);
        rods.settle({.tolerance = 1e-9 * length, .perturbation = perturbation});
    }
}

}  // namespace

std::vector<Check> run_cantilever(const Json& test) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    const Json& tip = test.at("reference").at("tip_xy_m");
    const Double3 reference{tip.at(0).get<double>(), tip.at(1).get<double>(), 0};
    std::vector<Check> checks;
    for (const auto& [edges, tolerance] : resolutions(test.at("tolerance"))) {
        RodStrand strand = straight_strand(edges, length, {1, 0, 0});
        strand.material = material_of(setup);
        RodSimulation rods = make_rods({strand}, settings_of(setup));
        const SettleReport rest = rods.settle({.tolerance = 1e-9 * length});
        const double error = distance(rods.position(0, edges), reference) / length;
        checks.push_back({at("tip error / L", edges), error, 0, rest.settled ? error : std::nan(""), tolerance});
    }
    return checks;
}

std::vector<Check> run_helix(const Json& test) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    const Double3 reference = vector3(test.at("reference").at("pos_L_m"));
    std::vector<Check> checks;
    for (const auto& [edges, tolerance] : resolutions(test.at("tolerance"))) {
        RodStrand strand = straight_strand(edges, length, {0, 0, 1});
        strand.material = material_of(setup);
        strand.root_frame = {Double3{0, 0, 1}, Double3{1, 0, 0}};
        RodSimulation rods = make_rods({strand}, settings_of(setup));
        ramp_curvature(rods, {0, setup.at("kappa_n_per_m").get<double>(), setup.at("tau_n_per_m").get<double>()},
                       length, 0);
        const double error = distance(rods.position(0, edges), reference) / length;
        checks.push_back({at("tip error / L", edges), error, 0, error, tolerance});
    }
    return checks;
}

std::vector<Check> run_kirchhoff_3d(const Json& test) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    const Json& frame = setup.at("clamp_frame_d1_d2_d3");
    const Double3 tangent = from_z_up(vector3(frame.at(2))), normal = from_z_up(vector3(frame.at(0)));
    Double3 u = vector3(setup.at("u0_times_L"));
    for (double& v : u) v /= length;
    const bool planar = u[0] == 0 && u[2] == 0;  // and may bend out of the plane to either side
    Double3 reference = from_z_up(vector3(test.at("reference").at("tip_over_L")));
    Double3 mirror = reference;
    mirror[2] = -mirror[2];
    std::vector<Check> checks;
    for (const auto& [edges, tolerance] : resolutions(test.at("tolerance"))) {
        RodStrand strand = straight_strand(edges, length, tangent);
        strand.material = material_of(setup);
        // C/B = 1/(1 + nu) for a circular section
        if (setup.contains("C_over_B")) strand.material.poisson_ratio = std::min(0.5, 1 / setup.at("C_over_B").get<double>() - 1);
        strand.root_frame = {tangent, normal};
        RodSimulation rods = make_rods({strand}, settings_of(setup));
        ramp_curvature(rods, {u[0], u[1], u[2]}, length, planar ? 1e-4 * length : 0);
        Double3 tip = rods.position(0, edges);
        for (double& x : tip) x /= length;
        double error = distance(tip, reference);
        if (planar) error = std::min(error, distance(tip, mirror));
        checks.push_back({at("tip error / L", edges), error, 0, error, tolerance});
    }
    return checks;
}

std::vector<Check> run_catenary(const Json& test) {
    const Json& setup = test.at("setup");
    const Json& reference = test.at("reference");
    const double length = setup.at("length_m").get<double>(), span = setup.at("span_m").get<double>();
    RodSettings settings = settings_of(setup);
    // a modulus for bending only: the note names the one that stretching keeps
    const std::string note = setup.value("note", "");
    std::smatch match;
    if (std::regex_search(note, match, std::regex("EA as for E=([0-9.eE+-]+)")))
        settings.stretch_scale = std::stod(match[1]) / setup.at("E_Pa").get<double>();
    std::vector<Check> checks;
    for (const auto& [edges, tolerance] : resolutions(test.at("tolerance"))) {
        RodStrand strand;
        strand.rest_points = straight_strand(edges, length, {1, 0, 0}).points;
        // hung in a V at first
        const double depth = std::sqrt(length * length - span * span) / 2;
        for (std::size_t i = 0; i <= edges; ++i) {
            const double s = static_cast<double>(i) / static_cast<double>(edges);
            strand.points.push_back({span * s, -depth * (1 - std::abs(2 * s - 1)), 0});
        }
        strand.material = material_of(setup);
        strand.root = strand.tip = RodEnd::pinned;
        RodSimulation rods = make_rods({strand}, settings);
        const SettleReport rest = rods.settle({.tolerance = 1e-9 * length});
        double lowest = 0;
        for (const Double3& p : rods.points(0)) lowest = std::min(lowest, p[1]);
        // the end holds the first edge and its own half of that edge's weight
        const Double3 t = rods.tangent(0, 0);
        const double pull = rods.tension(0, 0);
        const double down = pull * t[1] + rods.vertex_mass(0, 0) * settings.gravity[1];
        const double end = std::hypot(pull * t[0], down);
        const double sag = reference.at("sag_m").get<double>(), tension = reference.at("T_end_N").get<double>();
        const double fail = rest.settled ? 0 : std::nan("");
        checks.push_back({at("sag (m)", edges), -lowest, sag, relative(-lowest, sag) + fail, tolerance});
        checks.push_back({at("end tension (N)", edges), end, tension, relative(end, tension) + fail, tolerance});
    }
    return checks;
}

std::vector<Check> run_self_stretch(const Json& test) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    const double tolerance = test.at("tolerance").at("any_N").get<double>();
    std::vector<Check> checks;
    for (const std::size_t edges : {4, 20, 100}) {
        RodStrand strand = straight_strand(edges, length, {0, -1, 0});
        strand.material = material_of(setup);
        RodSimulation rods = make_rods({strand}, settings_of(setup));
        rods.settle({.tolerance = 1e-12 * length});
        const double tip = -rods.position(0, edges)[1] - length;
        const double middle = -rods.position(0, edges / 2)[1] - length / 2;
        const double tip_reference = test.at("reference").at("tip_extension_m").get<double>();
        const double middle_reference = test.at("reference").at("mid_extension_m").get<double>();
        checks.push_back({at("tip extension (m)", edges), tip, tip_reference, relative(tip, tip_reference), tolerance});
        checks.push_back({at("middle extension (m)", edges), middle, middle_reference,
                          relative(middle, middle_reference), tolerance});
    }
    return checks;
}

}  // namespace keratin::report
