// A validation case and what running it came to (INTERFACES "Validation"; cases are files of the schema
// hair-validation-1).
#pragma once

#include "runtime/rod/rod_simulation.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace keratin::report {

using Json = nlohmann::json;

// One number against its reference. `error` is what the tolerance bounds: relative or absolute as the
// case's metric says.
struct Check {
    std::string what;  // "tip error / L, N 20"
    double measured = 0, reference = 0, error = 0, tolerance = 0;
    bool passed() const { return error <= tolerance; }  // false when not a number
};

struct Outcome {
    std::string id, family;
    std::vector<Check> checks;
    std::string not_applicable;  // the reason; empty: it was run
    double seconds = 0;          // wall
    bool passed() const {
        if (!not_applicable.empty() || checks.empty()) return false;
        for (const Check& c : checks)
            if (!c.passed()) return false;
        return true;
    }
};

// The resolutions a case states a tolerance for: "N20": 0.01 -> {20, 0.01}, coarse to fine.
struct Resolution {
    std::size_t edges;
    double tolerance;
};
std::vector<Resolution> resolutions(const Json& tolerance);

// ---- building blocks of the families -------------------------------------------------------------

// Cases have z up or y up; both are turned to y up. A case with z up: (x, y, z) -> (x, z, -y).
inline Double3 from_z_up(const Double3& v) { return {v[0], v[2], -v[1]}; }

inline Double3 vector3(const Json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

// A straight strand of `edges` equal edges from the origin along `direction`.
RodStrand straight_strand(std::size_t edges, double length, const Double3& direction);
// Radius, modulus, density and, where given, Poisson's ratio of a case's set-up.
RodMaterial material_of(const Json& setup);

// Gravity of a case's set-up; one thread.
RodSettings settings_of(const Json& setup);
// "tip error / L, N 20"
std::string at(const char* what, std::size_t edges);

inline double relative(double measured, double reference) { return std::abs(measured / reference - 1); }
double distance(const Double3& a, const Double3& b);

// Simulation of strands that the families themselves make: anything refused is a fault of theirs.
RodSimulation make_rods(const std::vector<RodStrand>& strands, const RodSettings& settings);

// The parameter at which `buckled` turns from false to true between low and high (of which it must be
// false at low and true at high), to a relative width. Seven parameters are tried at a time, side by
// side in lanes.
using Buckled = std::vector<bool> (*)(const Json&, std::size_t edges, const std::vector<double>& parameters);
double find_threshold(const Json& test, std::size_t edges, Buckled buckled, double low, double high, double width);
// The first pair of neighbours in `low`, low + step, ... `high` between which it turns; NaN if none.
std::pair<double, double> bracket_threshold(const Json& test, std::size_t edges, Buckled buckled, double low,
                                            double high, double step);

// ---- the families ----------------------------------------------------------------------------------

using Family = std::vector<Check> (*)(const Json& test);
// nullptr: no such family.
Family find_family(const std::string& name);

std::vector<Check> run_cantilever(const Json& test);
std::vector<Check> run_helix(const Json& test);
std::vector<Check> run_kirchhoff_3d(const Json& test);
std::vector<Check> run_catenary(const Json& test);
std::vector<Check> run_self_stretch(const Json& test);
std::vector<Check> run_bend_twist(const Json& test);
std::vector<Check> run_lateral_buckling(const Json& test);
std::vector<Check> run_greenhill(const Json& test);
std::vector<Check> run_michell_ring(const Json& test);
std::vector<Check> run_vibration(const Json& test);
std::vector<Check> run_pendulum(const Json& test);
std::vector<Check> run_falling_hair(const Json& test);
std::vector<Check> run_incline(const Json& test);
std::vector<Check> run_sliding_block(const Json& test);
std::vector<Check> run_capstan(const Json& test);
std::vector<Check> run_stick_slip(const Json& test);
std::vector<Check> run_free_rod_contact(const Json& test);
std::vector<Check> run_coulomb_residual(const Json& test);

// Runs one case with the rod solver; says so where it cannot.
Outcome run_case(const Json& test);

}  // namespace keratin::report
