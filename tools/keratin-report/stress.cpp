#include "tools/keratin-report/stress.h"

#include "runtime/rod/double3.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <regex>
#include <stdexcept>

namespace keratin::report {

namespace {

constexpr double kPi = 3.14159265358979323846;

// Cases say some things in words with numbers between them. The number that stands before (after) a
// word; words are regular expressions.
std::optional<double> found(const std::string& text, const std::string& pattern) {
    std::smatch m;
    if (!std::regex_search(text, m, std::regex(pattern, std::regex::icase))) return {};
    return std::stod(m[1].str());
}
constexpr const char* kNumber = "([-+]?[0-9]+\\.?[0-9]*(?:e[-+]?[0-9]+)?)";
std::optional<double> number_before(const std::string& text, const std::string& word) {
    return found(text, std::string(kNumber) + "\\s*" + word);
}
std::optional<double> number_after(const std::string& text, const std::string& word) {
    return found(text, word + "\\s*" + kNumber);
}
bool says(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

double need(std::optional<double> value, const std::string& text) {
    if (!value) throw std::runtime_error("no number where one is needed in \"" + text + "\"");
    return *value;
}

Double3 axis_of(const std::string& text) {
    if (text.starts_with("z")) return {0, 0, 1};
    if (text.starts_with("y")) return {0, 1, 0};
    return {1, 0, 0};  // x, or the tangent
}

// Points along +x with the given edges.
std::vector<Double3> along_x(const std::vector<double>& edges) {
    std::vector<Double3> points{{0, 0, 0}};
    for (double e : edges) points.push_back({points.back()[0] + e, 0, 0});
    return points;
}
std::vector<double> equal_edges(double length, std::size_t vertices) {
    if (vertices < 2) return {};
    return std::vector<double>(vertices - 1, length / static_cast<double>(vertices - 1));
}

// Everything past a vertex turned about it, in the plane of x and y.
void fold(std::vector<Double3>& points, std::size_t vertex, double angle) {
    const Double3 pivot = points.at(vertex);
    for (std::size_t i = vertex + 1; i < points.size(); ++i)
        points[i] = add(pivot, turned({0, 0, angle}, subtract(points[i], pivot)));
}

// What a case changes, while it is read: a strand is made of its edges last of all.
struct Draft {
    Stress stress;
    std::size_t vertices = 0, count = 1;
    std::vector<double> edges;
    std::optional<std::size_t> fold_vertex;
    double fold_angle = kPi;
    std::optional<double> rest_fold;
    std::string placement;        // of the second strand
    double tip_density_scale = 1;
    bool said_duration = false;
};

void inside_sphere(Draft& d, const std::string& text) {
    const double radius = need(number_before(text, "cm"), text) / 100;
    d.stress.solids.push_back({.at = {d.stress.length / 2, 0, 0}, .radius = radius});
}

void initial(Draft& d, const Json& value) {
    const std::string text = value.get<std::string>();
    if (says(text, "anti-parallel") || says(text, "degrees")) {
        // "same with N degrees" speaks of the middle vertex of the folded strand
        const auto vertex = number_after(text, "vertex");
        d.fold_vertex = vertex ? static_cast<std::size_t>(*vertex) : d.vertices / 2;
        const auto angle = number_before(text, "degrees");
        d.fold_angle = angle && !says(text, "anti-parallel") ? *angle * kPi / 180 : kPi;
    } else if (says(text, "inside a sphere")) {
        inside_sphere(d, text);
    } else if (says(text, "below the scalp")) {
        const double depth = need(number_before(text, "mm"), text) / 1000;
        d.stress.solids.push_back({.kind = StressSolid::Kind::plane, .at = {depth, 0, 0}, .normal = {1, 0, 0}});
    } else if (says(text, "identical") || says(text, "parallel") || says(text, "intersect")) {
        d.placement = text;
        d.stress.strands_touch = true;
    } else {
        throw std::runtime_error("unknown initial state \"" + text + "\"");
    }
}

void through(Draft& d, const Json& change) {
    const double radius = change.at("sphere_radius_m").get<double>(), speed = change.at("speed_m_s").get<double>();
    // far enough away to be in the air for a few steps before it meets the strand
    const double before = std::max(4 * radius, 3 * speed * d.stress.step);
    d.stress.solids.push_back({.at = {d.stress.length / 2, 0, -before}, .radius = radius, .velocity = {0, 0, speed}});
}

void comb(Draft& d, const Json& change) {
    const auto count = change.at("contacts_on_one_strand").get<std::size_t>();
    const std::string how = change.value("how", "");
    if (const auto vertices = number_before(how, "vertices")) d.vertices = static_cast<std::size_t>(*vertices);
    d.edges = equal_edges(d.stress.length, d.vertices);
    const double r = d.stress.radius;
    for (std::size_t i = 0; i < count; ++i) {
        const double x = d.stress.length * (0.02 + 0.98 * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
        d.stress.solids.push_back({.at = {x, (i % 2 ? 2 : -2) * r, 0}, .radius = r});
    }
}

void drop_on_plane(Draft& d, const Json& change) {
    const Json& mu = change.at("mu");
    d.stress.friction = mu.is_number() ? mu.get<double>() : std::numeric_limits<double>::infinity();
    const std::string scene = change.value("scene", "strand dropped on a 30 degree plane");
    const double a = need(number_before(scene, "degree"), scene) * kPi / 180;
    d.stress.solids.push_back({.kind = StressSolid::Kind::plane, .at = {0, -5 * d.stress.radius, 0},
                               .normal = {std::sin(a), std::cos(a), 0}});
    d.stress.root_is_free = true;
}

void spin(Draft& d, const Json& change) {
    d.stress.root.path = RootPath::spin;
    d.stress.root.turn = scaled(change.at("root_angular_velocity_rad_s").get<double>(),
                                axis_of(change.value("axis", "z")));
}

void twist(Draft& d, const Json& change) {
    const double over = change.value("over_s", 1.0);
    d.stress.root = {.path = RootPath::twist,
                     .turn = {2 * kPi * change.at("root_twist_turns").get<double>() / over, 0, 0}, .lasts = over};
}

void accelerate(Draft& d, const Json& change) {
    d.stress.root = {.path = RootPath::accelerate,
                     .way = scaled(change.at("root_acceleration_m_s2").get<double>(),
                                   axis_of(change.value("direction", "y"))),
                     .lasts = change.at("duration_s").get<double>()};
}

void shake(Draft& d, const Json& value) {
    const std::string text = value.get<std::string>();
    const double amplitude = need(found(text, std::string("amplitude\\s*") + kNumber), text);
    d.stress.root = {.path = RootPath::shake, .way = {0, amplitude, 0}, .rate = need(number_before(text, "Hz"), text)};
}

void jump(Draft& d, const Json& change) {
    d.stress.root.path = RootPath::jump;
    d.stress.root.at = change.value("at_s", 0.5);
    if (change.contains("root_translation_m")) {
        const Json& v = change["root_translation_m"];
        d.stress.root.way = {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
    }
    if (change.contains("root_rotation_deg"))
        d.stress.root.turn = scaled(change["root_rotation_deg"].get<double>() * kPi / 180,
                                    axis_of(change.value("axis", "z")));
}

void bad_inputs(Draft& d, const std::string& text) {
    d.stress.procedure = Procedure::bad_input;
    const std::pair<const char*, BadInput> known[] = {
        {"negative radius", BadInput::negative_radius}, {"zero vertices", BadInput::no_vertices},
        {"1 vertex", BadInput::one_vertex},             {"quaternion", BadInput::zero_quaternion},
        {"dt=0", BadInput::zero_step},                  {"dt<0", BadInput::negative_step}};
    for (const auto& [word, what] : known)
        if (says(text, word)) d.stress.bad_inputs.push_back(what);
    if (d.stress.bad_inputs.empty()) throw std::runtime_error("unknown bad input \"" + text + "\"");
}

void what(Draft& d, const Json& value) {
    const std::string text = value.get<std::string>();
    if (!says(text, "NaN")) return bad_inputs(d, text);
    d.stress.procedure = Procedure::spoil;
    d.count = static_cast<std::size_t>(number_after(text, "of ").value_or(10));
    d.stress.spoiled_strand = static_cast<std::size_t>(number_after(text, "strand").value_or(1)) - 1;
    d.stress.spoiled_vertex = d.vertices / 2;
}

void note(Draft& d, const Json& value) {
    const std::string text = value.get<std::string>();
    if (says(text, "CGS") || says(text, "cgs")) {
        d.stress.procedure = Procedure::other_units;
    } else if (says(text, "save")) {
        d.stress.procedure = Procedure::resume;
        d.stress.resume_at = static_cast<std::size_t>(number_after(text, "frame").value_or(50));
    }
}

using Change = std::function<void(Draft&, const Json& value, const Json& change)>;

// Each word that a change may hold. Words that only go with another have no deed of their own.
const std::map<std::string, Change>& changes() {
    static const Change with_another = [](Draft&, const Json&, const Json&) {};
    static const std::map<std::string, Change> known = {
        {"E_scale", [](Draft& d, const Json& v, const Json&) { d.stress.youngs_modulus *= v.get<double>(); }},
        {"E_Pa", [](Draft& d, const Json& v, const Json&) { d.stress.youngs_modulus = v.get<double>(); }},
        {"radius_m", [](Draft& d, const Json& v, const Json&) { d.stress.radius = v.get<double>(); }},
        {"density", [](Draft& d, const Json& v, const Json&) { d.stress.density = v.get<double>(); }},
        {"gravity", [](Draft& d, const Json& v, const Json&) { d.stress.gravity = v.get<double>(); }},
        {"length_m", [](Draft& d, const Json& v, const Json&) {
             d.stress.length = v.get<double>();
             d.edges = equal_edges(d.stress.length, d.vertices);
         }},
        {"vertices", [](Draft& d, const Json& v, const Json&) {
             d.vertices = v.get<std::size_t>();
             d.edges = equal_edges(d.stress.length, d.vertices);
         }},
        {"one_segment_length_m", [](Draft& d, const Json& v, const Json& c) {
             const Json index = c.value("index", Json("middle"));
             const std::size_t at = index.is_number() ? index.get<std::size_t>() : d.edges.size() / 2;
             const double short_one = v.get<double>();
             const double others = (d.stress.length - short_one) / static_cast<double>(d.edges.size() - 1);
             for (double& e : d.edges) e = others;
             d.edges.at(at) = short_one;
         }},
        {"segment_length_ratio", [](Draft& d, const Json& v, const Json&) {
             double sum = 0;
             for (std::size_t i = 0; i < d.edges.size(); ++i) sum += d.edges[i] = i % 2 ? 1 : 1 / v.get<double>();
             for (double& e : d.edges) e *= d.stress.length / sum;
         }},
        {"uniform_scale", [](Draft& d, const Json& v, const Json&) {
             const double s = v.get<double>();
             d.stress.length *= s, d.stress.radius *= s;
             for (double& e : d.edges) e *= s;
         }},
        {"density_ratio_per_vertex", [](Draft& d, const Json& v, const Json&) { d.tip_density_scale = v.get<double>(); }},
        {"initial", [](Draft& d, const Json& v, const Json&) { initial(d, v); }},
        {"rest_curvature", [](Draft& d, const Json& v, const Json&) {
             const std::string text = v.get<std::string>();
             d.rest_fold = need(number_before(text, "degrees"), text) * kPi / 180;
         }},
        {"dt", [](Draft& d, const Json& v, const Json&) {
             if (v.is_number()) {
                 d.stress.step = v.get<double>();
                 return;
             }
             const std::string text = v.get<std::string>();
             d.stress.shortest = need(number_after(text, "\\["), text);
             d.stress.longest = need(number_after(text, ","), text);
             d.stress.seed = static_cast<std::uint64_t>(number_after(text, "seed").value_or(1));
         }},
        {"duration_s", [](Draft& d, const Json& v, const Json& c) {
             if (!c.contains("root_acceleration_m_s2")) d.stress.duration = v.get<double>();
         }},
        {"frames", [](Draft& d, const Json& v, const Json&) { d.stress.frames = v.get<std::size_t>(); }},
        {"root_translation_m", [](Draft& d, const Json&, const Json& c) { jump(d, c); }},
        {"root_rotation_deg", [](Draft& d, const Json&, const Json& c) { jump(d, c); }},
        {"root_angular_velocity_rad_s", [](Draft& d, const Json&, const Json& c) { spin(d, c); }},
        {"root_acceleration_m_s2", [](Draft& d, const Json&, const Json& c) { accelerate(d, c); }},
        {"root_motion", [](Draft& d, const Json& v, const Json&) { shake(d, v); }},
        {"root_twist_turns", [](Draft& d, const Json&, const Json& c) { twist(d, c); }},
        {"sphere_radius_m", [](Draft& d, const Json&, const Json& c) { through(d, c); }},
        {"contacts_on_one_strand", [](Draft& d, const Json&, const Json& c) { comb(d, c); }},
        {"mu", [](Draft& d, const Json&, const Json& c) { drop_on_plane(d, c); }},
        {"strands", [](Draft& d, const Json& v, const Json&) { d.count = v.get<std::size_t>(); }},
        {"offset_m", [](Draft& d, const Json& v, const Json&) {
             d.stress.procedure = Procedure::far;
             d.stress.offset = {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
         }},
        {"runs", [](Draft& d, const Json&, const Json&) { d.stress.procedure = Procedure::twice; }},
        {"threads", [](Draft& d, const Json& v, const Json&) { d.stress.threads = v.get<std::vector<int>>(); }},
        {"what", [](Draft& d, const Json& v, const Json&) { what(d, v); }},
        {"note", [](Draft& d, const Json& v, const Json&) { note(d, v); }},
        {"index", with_another}, {"pattern", with_another}, {"rest", with_another}, {"in_one_frame", with_another},
        {"at_s", with_another}, {"axis", with_another}, {"direction", with_another}, {"then", with_another},
        {"speed_m_s", with_another}, {"path", with_another}, {"how", with_another}, {"scene", with_another},
        {"over_s", with_another},
    };
    return known;
}

void place_second(Draft& d, StressStrand& second) {
    const std::string& text = d.placement;
    const double distance = number_before(text, "r\\b").value_or(0) * d.stress.radius;
    const double along = number_after(text, "offset of").value_or(0);
    for (std::vector<Double3>* points : {&second.points, &second.rest_points})
        for (Double3& p : *points) {
            if (says(text, "intersect"))  // turned about the middle by a right angle
                p = {d.stress.length / 2, 0, d.stress.length / 2 - p[0]};
            else if (says(text, "parallel"))
                p = add(p, {along, 0, distance});
        }
}

void make_strands(Draft& d) {
    StressStrand strand;
    strand.rest_points = along_x(d.edges);
    if (d.rest_fold) fold(strand.rest_points, d.vertices / 2, *d.rest_fold);
    strand.points = along_x(d.edges);
    if (d.rest_fold) strand.points = strand.rest_points;
    if (d.fold_vertex) fold(strand.points, *d.fold_vertex, d.fold_angle);
    if (d.tip_density_scale != 1) {
        strand.density_scale.assign(strand.points.size(), 1);
        strand.density_scale.back() = d.tip_density_scale;
    }
    d.stress.straight_at_rest = !d.rest_fold;
    d.stress.strands.assign(std::max<std::size_t>(1, d.count), strand);
    if (!d.placement.empty() && d.stress.strands.size() > 1) place_second(d, d.stress.strands[1]);
    if (d.stress.procedure == Procedure::spoil)
        for (std::size_t s = 0; s < d.stress.strands.size(); ++s)
            for (Double3& p : d.stress.strands[s].points) p[2] += 0.01 * static_cast<double>(s);
}

std::optional<double> bound(const Json& criteria, const char* name) {
    if (!criteria.contains(name) || !criteria[name].is_number()) return {};
    return criteria[name].get<double>();
}

Criteria read_criteria(const Json& j, const Stress& stress) {
    Criteria c;
    c.finite = j.value("finite", false);
    c.root = j.value("root", false);
    c.reject = j.value("reject", false);
    c.may_reject = j.contains("or_") && says(j["or_"].get<std::string>(), "reject");
    if (j.contains("bounded_energy")) {
        const Json& e = j["bounded_energy"];
        const std::string text = e.is_string() ? e.get<std::string>() : "";
        c.energy = Criteria::Energy::bounded;
        if (says(text, "first step")) c.energy = Criteria::Energy::after_first_step;
        if (says(text, "E_kin")) {
            c.energy = Criteria::Energy::spinning;
            c.spin_factor = need(number_before(text, "omega"), text);
        }
    }
    c.stretch = bound(j, "stretch");
    c.rest = bound(j, "rest");
    c.speed = bound(j, "speed");
    c.time = bound(j, "time");
    c.penetration = bound(j, "penetration");
    if (j.contains("penetration") && j["penetration"].is_string()) {
        const std::string text = j["penetration"].get<std::string>();
        c.penetration = need(number_after(text, "<="), text);
        c.penetration_from = need(number_after(text, "within"), text);
    }
    const std::string note = j.value("note", "");
    c.rest_at = c.rest ? number_before(note, "s\\b").value_or(0) : 0;
    if (says(note, "bitwise") || j.contains("others")) c.same = true;
    if (says(note, "drift of the equilibrium")) {
        c.drift = need(number_after(note, "within"), note);
        c.drift_from = static_cast<std::size_t>(need(number_after(note, "after"), note));
    }
    if (says(note, "trajector")) {
        const auto within = number_after(note, "within");
        c.trajectory = within ? within : need(number_before(note, "relative"), note);
    }
    if (says(note, "acceleration g sin") && stress.friction == 0) c.slide = need(number_before(note, "%"), note) / 100;
    if (says(note, "creep") && stress.friction >= need(number_after(note, "mu>="), note))
        c.creep = need(number_after(note, "creep <"), note);
    return c;
}

double number_of(const Json& baseline, const char* name) {
    if (!baseline.contains(name)) throw std::runtime_error(std::string("the baseline has no ") + name);
    return baseline[name].get<double>();
}

StressCase read_case(const Json& baseline, const Json& test) {
    StressCase out;
    out.id = test.at("id").get<std::string>();
    Draft d;
    Stress& s = d.stress;
    s.radius = number_of(baseline, "radius_m");
    s.youngs_modulus = number_of(baseline, "E_Pa");
    s.poisson_ratio = number_of(baseline, "poisson");
    s.density = number_of(baseline, "density");
    s.length = number_of(baseline, "length_m");
    s.gravity = number_of(baseline, "gravity");
    s.step = number_of(baseline, "dt");
    s.mass_damping = number_of(baseline, "mass_damping_1_s");
    s.duration = number_of(baseline, "duration_s");
    d.vertices = static_cast<std::size_t>(number_of(baseline, "vertices"));
    d.edges = equal_edges(s.length, d.vertices);
    const Json& change = test.at("change");
    // lengths and counts first: other changes count with them
    for (const char* first : {"length_m", "vertices", "radius_m", "dt"})
        if (change.contains(first)) changes().at(first)(d, change[first], change);
    for (const auto& [name, value] : change.items()) {
        const auto known = changes().find(name);
        if (known == changes().end()) {
            out.unknown = name;
            return out;
        }
        if (name != "length_m" && name != "vertices" && name != "radius_m" && name != "dt")
            known->second(d, value, change);
    }
    make_strands(d);
    out.stress = std::move(d.stress);
    out.criteria = read_criteria(test.at("criteria"), out.stress);
    if (const auto steps = number_before(test["criteria"].value("note", ""), "steps"))
        out.stress.frames = static_cast<std::size_t>(*steps);
    return out;
}

}  // namespace

const char* name_of(BadInput what) {
    switch (what) {
        case BadInput::negative_radius: return "a negative radius";
        case BadInput::no_vertices: return "a strand without vertices";
        case BadInput::one_vertex: return "a strand of one vertex";
        case BadInput::zero_quaternion: return "a rotation of length zero";
        case BadInput::zero_step: return "a step of 0 s";
        case BadInput::negative_step: return "a negative step";
    }
    return "";
}

Result<std::vector<StressCase>> read_stress(const Json& document, const std::string& file) {
    if (!document.contains("robustness") || !document["robustness"].is_object() ||
        !document["robustness"].contains("baseline") || !document["robustness"].contains("cases"))
        return Error{ErrorCode::input, file, "has no \"robustness\" with \"baseline\" and \"cases\""};
    const Json& robustness = document["robustness"];
    std::vector<StressCase> out;
    for (const Json& test : robustness["cases"]) {
        const std::string where = file + ": robustness.cases[" + std::to_string(out.size()) + "]";
        try {
            out.push_back(read_case(robustness["baseline"], test));
        } catch (const std::exception& error) {
            return Error{ErrorCode::input, where, error.what()};
        }
    }
    return out;
}

Double3 turn_between(const RootMotion& m, double from, double to) {
    switch (m.path) {
        case RootPath::jump:
            return from < m.at && m.at <= to ? m.turn : Double3{};
        case RootPath::spin:
        case RootPath::twist:
            return scaled(std::min(to, m.lasts) - std::min(from, m.lasts), m.turn);
        default:
            return {};
    }
}

RigidTransform root_at(const RootMotion& m, double t) {
    RigidTransform r;
    switch (m.path) {
        case RootPath::still:
        case RootPath::spin:
        case RootPath::twist:
            break;
        case RootPath::jump:
            if (t >= m.at) r.translation = m.way;
            break;
        case RootPath::accelerate: {
            const double a = std::min(t, m.lasts);
            r.translation = scaled(a * a / 2, m.way);
            break;
        }
        case RootPath::shake:
            r.translation = scaled(std::sin(2 * kPi * m.rate * t), m.way);
            break;
    }
    const Double3 w = turn_between(m, 0, t);
    if (const double angle = length(w); angle > 0) {
        const double s = std::sin(angle / 2) / angle;
        r.rotation = {s * w[0], s * w[1], s * w[2], std::cos(angle / 2)};
    }
    return r;
}

Double3 place_at(const StressSolid& solid, double t) { return add(solid.at, scaled(t, solid.velocity)); }

}  // namespace keratin::report
