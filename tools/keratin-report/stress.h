// What a robustness case asks of a solver: a strand or a few, how they are treated, for how long, and
// what must hold. Read from "robustness" of a file of the schema hair-validation-1: the baseline, and
// each case's "change" of it. SI, y up; strands start at the origin along +x.
#pragma once

#include "runtime/rod/rod_strand.h"
#include "runtime/settings.h"
#include "schema/result.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace keratin::report {

using Json = nlohmann::json;

struct StressStrand {
    std::vector<Double3> points;       // m, at the start
    std::vector<Double3> rest_points;  // m; lengths and angles at rest
    std::vector<double> density_scale;  // [points] or empty: 1
};

enum class RootPath { still, jump, spin, accelerate, shake, twist };

// How the roots move, as one rigid body about the first strand's root. Time 0: not at all.
struct RootMotion {
    RootPath path = RootPath::still;
    Double3 way{};            // jump: m; accelerate: m/s^2; shake: amplitude, m
    Double3 turn{};           // jump: rad; spin, twist: rad/s
    double at = 0;            // s, when a jump happens
    double rate = 0;          // Hz, of a shake
    double lasts = 1e300;     // s, of an acceleration or a twist; the root stands still afterwards
};

struct StressSolid {
    enum class Kind { sphere, plane } kind = Kind::sphere;
    Double3 at{};                // m: centre, or a point of the plane
    Double3 normal{0, 1, 0};     // of a plane
    double radius = 0;           // m
    Double3 velocity{};          // m/s
};

// What is done beside letting time pass.
enum class Procedure {
    run,
    far,          // the same far from the origin; both runs must agree
    other_units,  // the same with lengths in centimetres and masses in grams
    twice,        // again, with other numbers of threads
    resume,       // saved and continued in another simulation
    spoil,        // one vertex of one of several strands is not a number
    bad_input     // what cannot be: each must be refused
};

// The bad inputs that a case may list.
enum class BadInput { negative_radius, no_vertices, one_vertex, zero_quaternion, zero_step, negative_step };
const char* name_of(BadInput what);

struct Stress {
    double radius = 0, youngs_modulus = 0, poisson_ratio = 0, density = 0;
    double length = 0;  // m, of a strand
    double gravity = 0;  // m/s^2, along -y
    double mass_damping = 0;  // 1/s: force of -c m v on each point
    std::vector<StressStrand> strands;
    bool root_is_free = false;
    bool strands_touch = false;  // strand on strand
    double friction = 0.3;       // of everything; may be infinite
    RootMotion root;
    std::vector<StressSolid> solids;

    double step = 0, duration = 0;        // s
    double shortest = 0, longest = 0;     // s: random steps, log-uniform, when longest > 0
    std::uint64_t seed = 1;
    std::optional<std::size_t> frames;    // instead of the duration

    Procedure procedure = Procedure::run;
    Double3 offset{};              // m, for `far`
    std::size_t resume_at = 0;     // step
    std::vector<int> threads{1};
    std::size_t spoiled_strand = 0, spoiled_vertex = 0;
    std::vector<BadInput> bad_inputs;

    bool straight_at_rest = true;
};

// Bounds that a case sets; what is absent is not judged.
struct Criteria {
    bool finite = false, root = false;
    // Energy: never above the start's plus the work of the roots, or plus what the first step came
    // to where the start is singular, or E_kin <= 0.5 m (factor omega L)^2 of a spinning root.
    enum class Energy { unjudged, bounded, after_first_step, spinning } energy = Energy::unjudged;
    double spin_factor = 0;
    std::optional<double> stretch;       // any time; a tenth of it at the end
    std::optional<double> rest;          // of the length
    double rest_at = 0;                  // s: not before
    std::optional<double> speed;         // m/s
    std::optional<double> penetration;   // radii
    double penetration_from = 0;         // s
    std::optional<double> time;          // of the median step
    bool reject = false;                 // must be refused
    bool may_reject = false;
    std::optional<double> drift;         // of the length, between the frame and the end
    std::size_t drift_from = 0;          // frame
    std::optional<double> trajectory;    // m or of the length, against the other run
    std::optional<double> slide;         // relative error of the acceleration down the plane
    std::optional<double> creep;         // m/s at the end
    bool same = false;                   // bit for bit
};

struct StressCase {
    std::string id;
    Stress stress;
    Criteria criteria;
    std::string unknown;  // a change that this program does not know; the case is not run then
};

// Errors (input): where = the case's place, with what is missing or wrong.
Result<std::vector<StressCase>> read_stress(const Json& document, const std::string& file);

// Where the roots are at t, and by how much they turn between two times (any angle; rad).
RigidTransform root_at(const RootMotion& motion, double t);
Double3 turn_between(const RootMotion& motion, double from, double to);
Double3 place_at(const StressSolid& solid, double t);

}  // namespace keratin::report
