#include "runtime/rod/rod_simulation.h"

#include "runtime/rod/double3.h"
#include "runtime/rod/rod_energy.h"
#include "runtime/rod/rod_step.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace keratin {

namespace {

using Vec = Vector3<Double1>;
Vec vec(const Double3& a) { return {a[0], a[1], a[2]}; }
Double3 plain(const Vec& a) { return {a.x.v, a.y.v, a.z.v}; }

Error bad(std::string where, std::string message) {
    return {ErrorCode::input, std::move(where), std::move(message)};
}
std::string name(std::size_t s) { return "strands[" + std::to_string(s) + "]"; }

Result<void> check_material(const RodMaterial& m, const std::string& where) {
    for (const double r : m.radii)
        if (!(r > 0) || !std::isfinite(r)) return bad(where + ".radii", "must be positive");
    if (!(m.density > 0) || !std::isfinite(m.density))
        return bad(where + ".density", "must be positive: a strand without mass has no motion");
    if (!(m.youngs_modulus > 0) || !std::isfinite(m.youngs_modulus))
        return bad(where + ".youngs_modulus", "must be positive");
    if (!(m.poisson_ratio > -1) || !(m.poisson_ratio <= 0.5))
        return bad(where + ".poisson_ratio", "must be above -1 and at most 0.5");
    if (!(m.viscosity >= 0) || !std::isfinite(m.viscosity))
        return bad(where + ".viscosity", "must not be negative");
    if (!(m.air_drag >= 0) || !std::isfinite(m.air_drag))
        return bad(where + ".air_drag", "must not be negative");
    return {};
}

Result<void> check_points(std::span<const Double3> points, const std::string& where) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::string at = where + "[" + std::to_string(i) + "]";
        if (!is_finite(points[i])) return bad(at, "is not finite");
        if (i > 0 && !(length(subtract(points[i], points[i - 1])) > 0))
            return bad(at, "is the same as the point before: an edge needs a length");
    }
    return {};
}

Result<void> check_vectors(std::span<const Double3> values, std::size_t count, const std::string& where) {
    if (values.size() != count)
        return bad(where, "has " + std::to_string(values.size()) + " entries, the strand has " +
                              std::to_string(count) + " points");
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!is_finite(values[i])) return bad(where + "[" + std::to_string(i) + "]", "is not finite");
    return {};
}

Result<void> check_direction(const std::optional<Double3>& v, const std::string& where) {
    if (v && (!is_finite(*v) || !(length(*v) > 0))) return bad(where, "must be a direction");
    return {};
}

Result<void> check_strand(const RodStrand& s, const std::string& where) {
    if (s.points.size() < 2)
        return bad(where + ".points",
                   "has " + std::to_string(s.points.size()) + " points, a strand needs at least 2");
    if (auto r = check_points(s.points, where + ".points"); !r) return r;
    if (!s.velocities.empty())
        if (auto r = check_vectors(s.velocities, s.points.size(), where + ".velocities"); !r) return r;
    if (!s.rest_points.empty()) {
        if (auto r = check_vectors(s.rest_points, s.points.size(), where + ".rest_points"); !r) return r;
        if (auto r = check_points(s.rest_points, where + ".rest_points"); !r) return r;
    }
    if (!s.angles.empty() && s.angles.size() + 1 != s.points.size())
        return bad(where + ".angles", "needs one entry an edge");
    for (const double a : s.angles)
        if (!std::isfinite(a)) return bad(where + ".angles", "is not finite");
    if (!s.added_mass.empty() && s.added_mass.size() != s.points.size())
        return bad(where + ".added_mass", "needs one entry a point");
    for (const double m : s.added_mass)
        if (!(m >= 0) || !std::isfinite(m)) return bad(where + ".added_mass", "must not be negative");
    if (s.natural_curvature &&
        (!std::isfinite((*s.natural_curvature)[0]) || !std::isfinite((*s.natural_curvature)[1])))
        return bad(where + ".natural_curvature", "is not finite");
    if (!s.rest_strain.empty()) {
        const std::string at = where + ".rest_strain";
        if (s.natural_curvature) return bad(at, "cannot go with natural_curvature");
        if (s.rest_strain.size() + 1 != s.points.size()) return bad(at, "needs one entry an edge");
        for (std::size_t i = 0; i < s.rest_strain.size(); ++i) {
            const RodStrain& e = s.rest_strain[i];
            if (!(e.stretch > -1) || !std::isfinite(e.stretch) || !std::isfinite(e.bend[0]) ||
                !std::isfinite(e.bend[1]) || !std::isfinite(e.twist))
                return bad(at + "[" + std::to_string(i) + "]",
                           "must be finite, with a stretch above -1");
        }
    }
    if (!std::isfinite(s.natural_twist)) return bad(where + ".natural_twist", "is not finite");
    if (auto r = check_direction(s.root_frame.tangent, where + ".root_direction"); !r) return r;
    if (auto r = check_direction(s.root_frame.normal, where + ".root_normal"); !r) return r;
    if (auto r = check_direction(s.tip_frame.tangent, where + ".tip_direction"); !r) return r;
    if (auto r = check_direction(s.tip_frame.normal, where + ".tip_normal"); !r) return r;
    const std::size_t held = (s.root == RodEnd::clamped_two_points ? 2 : s.root != RodEnd::free) +
                             (s.tip == RodEnd::clamped_two_points ? 2 : s.tip != RodEnd::free);
    if (held > s.points.size())
        return bad(where, "both ends hold more points than the strand has");
    return check_material(s.material, where);
}

Result<void> check_settings(const RodSettings& s) {
    if (!is_finite(s.gravity)) return bad("gravity", "is not finite");
    if (!is_finite(s.air_velocity)) return bad("air_velocity", "is not finite");
    for (const double k : {s.stretch_scale, s.bend_scale, s.twist_scale})
        if (!(k > 0) || !std::isfinite(k)) return bad("settings", "stiffness scales must be positive");
    if (s.iterations < 1) return bad("settings.iterations", "must be at least 1");
    if (!(s.tolerance >= 0)) return bad("settings.tolerance", "must not be negative");
    return {};
}

struct Header {
    std::uint64_t magic = 0x31646f726e72656bULL;  // "kerrod1"
    std::uint64_t numbers = 0, rows = 0, strands = 0;
    double time = 0;
};

// A state that holds larger numbers, in m, m/s and rad, is damaged; their squares are still floats.
constexpr double kLargestNumber = 1e15;

// Bytes that save() writes.
std::size_t state_size(const RodBlocks& b) {
    return sizeof(Header) + (b.x.size() + b.v.size() + b.frames.size() + b.ends.size()) * sizeof(double) +
           b.shapes.size() * 12 * sizeof(Double3);
}

}  // namespace

struct RodSimulation::Impl : RodStepper {
    Double3 at(std::size_t s, std::size_t i) const {
        return {blocks.x[blocks.index(s, i, 0)], blocks.x[blocks.index(s, i, 1)],
                blocks.x[blocks.index(s, i, 2)]};
    }
    Double3 edge(std::size_t s, std::size_t j) const { return subtract(at(s, j + 1), at(s, j)); }
    Double3 frame(std::size_t s, std::size_t j, std::size_t from) const {
        return {blocks.frames[blocks.frame_index(s, j, from)],
                blocks.frames[blocks.frame_index(s, j, from + 1)],
                blocks.frames[blocks.frame_index(s, j, from + 2)]};
    }
    Double3 director(std::size_t s, std::size_t j) const {
        return plain(material_directors(vec(frame(s, j, 0)), vec(frame(s, j, 3)),
                                        Double1(blocks.x[blocks.index(s, j, 3)]))
                         .m1);
    }
    Double3 end_vector(std::size_t s, std::size_t from) const {
        return {blocks.ends[blocks.end_index(s, from)], blocks.ends[blocks.end_index(s, from + 1)],
                blocks.ends[blocks.end_index(s, from + 2)]};
    }
    RodEndState& end(std::size_t s, RodTip which) {
        return which == RodTip::root ? blocks.shapes[s].root : blocks.shapes[s].tip;
    }
    // The numbers of an end that follow from where the strand is now.
    void anchor(std::size_t s, RodTip which) {
        RodEndState& e = end(s, which);
        const std::size_t last = blocks.edge_count_of(s);
        const std::size_t point = which == RodTip::root ? 0 : last;
        e.position = e.target = at(s, point);
        e.turn = {0, 0, 0};
        e.span = subtract(at(s, which == RodTip::root ? 1 : last - 1), e.position);
    }
    void write(std::size_t s) { write_strand(blocks, s, scales()); }
    Result<void> check_vertex(std::size_t s, std::size_t i) const {
        if (s >= blocks.first.size()) return bad(name(s), "there is no such strand");
        if (i >= blocks.vertex_count[s])
            return bad(name(s) + ".points[" + std::to_string(i) + "]", "there is no such point");
        return {};
    }
    Result<void> set_target(std::size_t s, RodTip which, const RodEndTarget& target) {
        if (auto r = check_vertex(s, 0); !r) return r;
        const std::string where = name(s) + (which == RodTip::root ? ".root" : ".tip");
        if (!is_finite(target.position) || !is_finite(target.turn)) return bad(where, "is not finite");
        RodEndState& e = end(s, which);
        if (e.kind == RodEnd::free) return bad(where, "is free and cannot be moved");
        e.target = subtract(target.position, blocks.origin);
        e.turn = target.turn;
        return {};
    }
    void build(std::size_t s, const RodStrand& strand);
};

void RodSimulation::Impl::build(std::size_t s, const RodStrand& strand) {
    RodShape& shape = blocks.shapes[s];
    const std::size_t last = strand.points.size() - 1;
    place_strand(blocks, s, strand);
    anchor(s, RodTip::root);
    anchor(s, RodTip::tip);
    // a two-point clamp turns its edge's own director
    if (strand.root == RodEnd::clamped_two_points) {
        shape.root.tangent = unit(edge(s, 0));
        shape.root.director = director(s, 0);
    }
    if (strand.tip == RodEnd::clamped_two_points) {
        shape.tip.tangent = unit(edge(s, last - 1));
        shape.tip.director = director(s, last - 1);
    }
    write(s);
}

RodSimulation::RodSimulation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RodSimulation::RodSimulation(RodSimulation&&) noexcept = default;
RodSimulation& RodSimulation::operator=(RodSimulation&&) noexcept = default;
RodSimulation::~RodSimulation() = default;

Result<RodSimulation> RodSimulation::create(std::span<const RodStrand> strands, const RodSettings& settings) {
    if (auto r = check_settings(settings); !r) return r.error();
    for (std::size_t s = 0; s < strands.size(); ++s)
        if (auto r = check_strand(strands[s], name(s)); !r) return r.error();
    auto impl = std::make_unique<Impl>();
    impl->settings = settings;
    impl->passes = &rod_passes(settings.instruction_set);
    impl->blocks = make_blocks(strands, impl->passes->lanes);
    for (std::size_t s = 0; s < strands.size(); ++s) impl->build(s, strands[s]);
    lay_out_work(*impl);
    return RodSimulation(std::move(impl));
}

std::size_t RodSimulation::strand_count() const { return impl_->blocks.first.size(); }
std::size_t RodSimulation::vertex_count(std::size_t s) const { return impl_->blocks.vertex_count[s]; }
RodLayout RodSimulation::layout() const { return impl_->blocks.layout(); }
const RodSettings& RodSimulation::settings() const { return impl_->settings; }
double RodSimulation::time() const { return impl_->time; }
std::span<const double> RodSimulation::numbers() const { return impl_->blocks.x.span(); }
std::span<const double> RodSimulation::rates() const { return impl_->blocks.v.span(); }
const Double3& RodSimulation::origin() const { return impl_->blocks.origin; }

void RodSimulation::attach_contact(ContactSolver* contact) {
    impl_->contact = contact;
    lay_out_work(*impl_);
}

Result<void> RodSimulation::move_root(std::size_t s, const RodEndTarget& target) {
    return impl_->set_target(s, RodTip::root, target);
}
Result<void> RodSimulation::move_tip(std::size_t s, const RodEndTarget& target) {
    return impl_->set_target(s, RodTip::tip, target);
}

Result<void> RodSimulation::set_force(std::size_t s, std::size_t vertex, const Double3& force) {
    if (auto r = impl_->check_vertex(s, vertex); !r) return r;
    if (!is_finite(force)) return bad(name(s) + ".force", "is not finite");
    for (std::size_t c = 0; c < 3; ++c) impl_->blocks.force[impl_->blocks.index(s, vertex, c)] = force[c];
    return {};
}

Result<void> RodSimulation::set_spring(std::size_t s, std::size_t vertex, const Double3& point, double stiffness) {
    if (auto r = impl_->check_vertex(s, vertex); !r) return r;
    if (!is_finite(point) || !std::isfinite(stiffness) || stiffness < 0)
        return bad(name(s) + ".spring", "needs a finite point and a stiffness that is not negative");
    RodBlocks& b = impl_->blocks;
    for (std::size_t c = 0; c < 3; ++c) {
        b.spring[b.index(s, vertex, c)] = stiffness;
        b.spring_target[b.index(s, vertex, c)] = point[c] - b.origin[c];
    }
    return {};
}

Result<void> RodSimulation::set_material(std::size_t s, const RodMaterial& material) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    if (auto r = check_material(material, name(s)); !r) return r;
    impl_->blocks.shapes[s].material = material;
    impl_->write(s);
    return {};
}

Result<void> RodSimulation::set_natural_curvature(std::size_t s, const std::array<double, 2>& curvature,
                                                  double twist) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    if (!std::isfinite(curvature[0]) || !std::isfinite(curvature[1]) || !std::isfinite(twist))
        return bad(name(s) + ".natural_curvature", "is not finite");
    rest_from_curvature(curvature, twist, impl_->blocks.shapes[s]);
    impl_->write(s);
    return {};
}

Result<void> RodSimulation::set_rest_points(std::size_t s, std::span<const Double3> points) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    const std::string where = name(s) + ".rest_points";
    if (auto r = check_vectors(points, vertex_count(s), where); !r) return r;
    if (auto r = check_points(points, where); !r) return r;
    rest_from_points(points, impl_->blocks.shapes[s]);
    impl_->write(s);
    return {};
}

Result<void> RodSimulation::set_end(std::size_t s, RodTip which, RodEnd kind) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    Impl& m = *impl_;
    RodEndState& e = m.end(s, which);
    const std::size_t edge = which == RodTip::root ? 0 : m.blocks.edge_count_of(s) - 1;
    e.kind = kind;
    e.tangent = m.frame(s, edge, 0);
    e.director = m.director(s, edge);
    m.anchor(s, which);
    const std::size_t from = which == RodTip::root ? 0 : 6;
    for (std::size_t c = 0; c < 3; ++c) {
        m.blocks.ends[m.blocks.end_index(s, from + c)] = e.tangent[c];
        m.blocks.ends[m.blocks.end_index(s, from + 3 + c)] = e.director[c];
    }
    const std::size_t joint = which == RodTip::root ? 0 : m.blocks.edge_count_of(s);
    // the edge's angle from the clamp's director is its own angle: no twist as it is held
    const double angle = m.blocks.x[m.blocks.index(s, edge, 3)];
    m.blocks.frames[m.blocks.frame_index(s, joint, 6)] = which == RodTip::root ? -angle : angle;
    m.write(s);
    return {};
}

Result<void> RodSimulation::set_gravity(const Double3& gravity) {
    if (!is_finite(gravity)) return bad("gravity", "is not finite");
    impl_->settings.gravity = gravity;
    return {};
}

Result<void> RodSimulation::set_velocities(std::size_t s, std::span<const Double3> velocities) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    if (auto r = check_vectors(velocities, vertex_count(s), name(s) + ".velocities"); !r) return r;
    for (std::size_t i = 0; i < velocities.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            impl_->blocks.v[impl_->blocks.index(s, i, c)] = velocities[i][c];
    return {};
}

Result<void> RodSimulation::set_points(std::size_t s, std::span<const Double3> points,
                                       std::span<const Double3> velocities) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    if (auto r = check_vectors(points, vertex_count(s), name(s) + ".points"); !r) return r;
    if (auto r = check_points(points, name(s) + ".points"); !r) return r;
    if (auto r = check_vectors(velocities, vertex_count(s), name(s) + ".velocities"); !r) return r;
    RodBlocks& b = impl_->blocks;
    for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c) {
            b.x[b.index(s, i, c)] = c < 3 ? points[i][c] - b.origin[c] : 0;
            b.v[b.index(s, i, c)] = c < 3 ? velocities[i][c] : 0;
        }
    reset_frames(b, s);
    impl_->anchor(s, RodTip::root);
    impl_->anchor(s, RodTip::tip);
    return {};
}

Result<void> RodSimulation::teleport(std::size_t s, const RodEndTarget& root) {
    if (auto r = impl_->check_vertex(s, 0); !r) return r;
    if (!is_finite(root.position) || !is_finite(root.turn)) return bad(name(s) + ".root", "is not finite");
    RodBlocks& b = impl_->blocks;
    const Double3 from = impl_->at(s, 0), to = subtract(root.position, b.origin);
    for (std::size_t i = 0; i < b.vertex_count[s]; ++i) {
        const Double3 x = add(to, turned(root.turn, subtract(impl_->at(s, i), from)));
        const Double3 v = turned(root.turn, {b.v[b.index(s, i, 0)], b.v[b.index(s, i, 1)], b.v[b.index(s, i, 2)]});
        const Double3 t = turned(root.turn, impl_->frame(s, i, 0)), a = turned(root.turn, impl_->frame(s, i, 3));
        for (std::size_t c = 0; c < 3; ++c) {
            b.x[b.index(s, i, c)] = x[c];
            b.v[b.index(s, i, c)] = v[c];
            b.frames[b.frame_index(s, i, c)] = t[c];
            b.frames[b.frame_index(s, i, 3 + c)] = a[c];
        }
    }
    for (std::size_t from_end = 0; from_end < 12; from_end += 3) {
        const Double3 d = turned(root.turn, impl_->end_vector(s, from_end));
        for (std::size_t c = 0; c < 3; ++c) b.ends[b.end_index(s, from_end + c)] = d[c];
    }
    for (const RodTip which : {RodTip::root, RodTip::tip}) {
        RodEndState& e = impl_->end(s, which);
        e.tangent = turned(root.turn, e.tangent);
        e.director = turned(root.turn, e.director);
        impl_->anchor(s, which);
    }
    return {};
}

Result<RodStepReport> RodSimulation::step(double h) {
    if (!(h >= 1e-9) || !(h <= 10))
        return bad("step", "is " + std::to_string(h) + " s, must lie in 1e-9 .. 10 s");
    if (impl_->contact != nullptr && impl_->settings.integrator != RodIntegrator::euler)
        return bad("settings.integrator", "must be euler where strands have contact");
    return take_step(*impl_, h);
}

SettleReport RodSimulation::settle(const SettleOptions& options) {
    Impl& m = *impl_;
    RodBlocks& b = m.blocks;
    const RodSettings kept = m.settings;
    const double time = m.time;
    SettleReport report;
    const auto stand = [&] { std::fill_n(b.v.data(), b.v.size(), 0.0); };
    if (options.perturbation > 0) {
        std::mt19937_64 random(options.seed);
        for (std::size_t s = 0; s < b.first.size(); ++s)
            for (std::size_t i = 0; i < b.vertex_count[s]; ++i)
                for (std::size_t c = 0; c < 3; ++c) {
                    // 53 random bits as -1..1: the library's distributions differ between systems
                    const double u = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
                    const std::size_t k = b.index(s, i, c);
                    if (b.inverse_mass[k] > 0) b.x[k] += options.perturbation * u;
                }
    }
    AlignedDoubles before(b.x.size());
    double h = options.first_step;
    m.settings.newton = RodNewton::full;
    m.settings.integrator = RodIntegrator::euler;
    m.settings.halvings = 0;
    // s: from kEnough on inertia hides nothing but what is barely unstable
    constexpr double kLongest = 1e3, kEnough = 1;
    for (std::uint32_t k = 0; k < options.steps; ++k) {
        std::copy_n(b.x.data(), b.x.size(), before.data());
        stand();
        m.settings.tolerance = 1e-3 * options.tolerance / h;
        const RodStepReport step = take_step(m, h);
        report.steps = k + 1;
        report.last_movement = 0;
        for (std::size_t s = 0; s < b.first.size(); ++s)
            for (std::size_t i = 0; i < b.vertex_count[s]; ++i)
                for (std::size_t c = 0; c < 3; ++c) {
                    const double d = std::fabs(b.x[b.index(s, i, c)] - before[b.index(s, i, c)]);
                    report.last_movement = std::max(report.last_movement, d);
                }
        const bool clean = step.at_cap == 0 && step.indefinite == 0;
        if (clean && h >= kEnough && report.last_movement <= options.tolerance) {
            report.settled = true;
            break;
        }
        // Where the Hessian was indefinite the strand is leaving an unstable shape: a step at which
        // inertia outweighs that takes it along quickly and safely.
        h = clean ? std::min(kLongest, 3 * h) : std::max(1e-6, h / (step.at_cap > 0 ? 8 : 2));
    }
    stand();
    m.settings = kept;
    m.time = time;
    return report;
}

Double3 RodSimulation::position(std::size_t s, std::size_t i) const {
    return add(impl_->at(s, i), impl_->blocks.origin);
}
Double3 RodSimulation::velocity(std::size_t s, std::size_t i) const {
    const RodBlocks& b = impl_->blocks;
    return {b.v[b.index(s, i, 0)], b.v[b.index(s, i, 1)], b.v[b.index(s, i, 2)]};
}
std::vector<Double3> RodSimulation::points(std::size_t s) const {
    std::vector<Double3> out(vertex_count(s));
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = position(s, i);
    return out;
}
std::vector<Double3> RodSimulation::velocities(std::size_t s) const {
    std::vector<Double3> out(vertex_count(s));
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = velocity(s, i);
    return out;
}
double RodSimulation::angle(std::size_t s, std::size_t j) const {
    return impl_->blocks.x[impl_->blocks.index(s, j, 3)];
}
Double3 RodSimulation::tangent(std::size_t s, std::size_t j) const { return unit(impl_->edge(s, j)); }
Double3 RodSimulation::director(std::size_t s, std::size_t j) const { return impl_->director(s, j); }

double RodSimulation::twist(std::size_t s) const {
    const RodBlocks& b = impl_->blocks;
    double sum = 0, before = 0;
    for (std::size_t i = 0; i < b.vertex_count[s]; ++i) {
        const double angle = i < b.edge_count_of(s) ? b.x[b.index(s, i, 3)] : 0;
        if (b.joints[b.joint_index(s, i, 2)] > 0)
            sum += angle - before + b.frames[b.frame_index(s, i, 6)];
        before = angle;
    }
    return sum;
}

double RodSimulation::edge_stretch(std::size_t s, std::size_t j) const {
    return length(impl_->edge(s, j)) / impl_->blocks.edges[impl_->blocks.edge_index(s, j, 1)] - 1;
}
double RodSimulation::tension(std::size_t s, std::size_t j) const {
    const RodBlocks& b = impl_->blocks;
    return b.edges[b.edge_index(s, j, 0)] * (length(impl_->edge(s, j)) - b.edges[b.edge_index(s, j, 1)]);
}
double RodSimulation::vertex_mass(std::size_t s, std::size_t i) const {
    return impl_->blocks.mass[impl_->blocks.index(s, i, 0)];
}

RodEnergy RodSimulation::energy(std::size_t s) const {
    const RodBlocks& b = impl_->blocks;
    RodEnergy e;
    const std::size_t edges = b.edge_count_of(s);
    Double3 t = impl_->end_vector(s, 0), a = impl_->end_vector(s, 3);
    auto before = material_directors(vec(t), vec(a), Double1(0));
    double angle_before = 0;
    for (std::size_t i = 0; i <= edges; ++i) {
        for (std::size_t c = 0; c < 4; ++c) {
            if (i == edges && c == 3) continue;
            const std::size_t k = b.index(s, i, c);
            e.kinetic += b.mass[k] * b.v[k] * b.v[k] / 2;
            if (c < 3) e.potential -= b.mass[k] * impl_->settings.gravity[c] * (b.x[k] + b.origin[c]);
        }
        Double3 u = impl_->end_vector(s, 6), d = impl_->end_vector(s, 9);
        double angle = 0;
        if (i < edges) {
            const double k = b.edges[b.edge_index(s, i, 0)], rest = b.edges[b.edge_index(s, i, 1)];
            const Double3 edge = impl_->edge(s, i);
            e.stretch += stretch_energy(Double1(k), Double1(rest), Double1(length(edge))).v;
            u = unit(edge);
            d = impl_->frame(s, i, 3);
            angle = b.x[b.index(s, i, 3)];
        }
        const auto after = material_directors(vec(u), vec(d), Double1(angle));
        JointMaterial<Double1> m;
        Double1* value[] = {&m.k1, &m.k2, &m.kt, &m.rest1_before, &m.rest2_before,
                            &m.rest1_after, &m.rest2_after, &m.rest_twist};
        for (std::size_t c = 0; c < kRodJoint; ++c) *value[c] = b.joints[b.joint_index(s, i, c)];
        if (m.kt.v > 0) {
            const auto joint = make_joint(vec(t), Double1(1), before, vec(u), Double1(1), after);
            e.bend += bend_energy(m, joint).v;
            e.twist += twist_energy(m, Double1(angle - angle_before + b.frames[b.frame_index(s, i, 6)])).v;
        }
        t = u;
        before = after;
        angle_before = angle;
    }
    return e;
}

double RodSimulation::max_stretch() const {
    double worst = 0;
    for (std::size_t s = 0; s < strand_count(); ++s)
        for (std::size_t j = 0; j < impl_->blocks.edge_count_of(s); ++j)
            worst = std::max(worst, std::fabs(edge_stretch(s, j)));
    return worst;
}
double RodSimulation::max_speed() const {
    double worst = 0;
    for (std::size_t s = 0; s < strand_count(); ++s)
        for (std::size_t i = 0; i < vertex_count(s); ++i) worst = std::max(worst, length(velocity(s, i)));
    return worst;
}
bool RodSimulation::finite() const {
    for (const AlignedDoubles* a : {&impl_->blocks.x, &impl_->blocks.v, &impl_->blocks.frames})
        for (const double v : a->span())
            if (!std::isfinite(v)) return false;
    return true;
}

const RodStats& RodSimulation::stats() const {
    RodBlocks& b = impl_->blocks;
    std::size_t numbers = 0;
    for (const AlignedDoubles* a : {&b.x, &b.v, &b.mass, &b.inverse_mass, &b.force, &b.spring, &b.spring_target,
                                    &b.drag, &b.frames, &b.edges, &b.joints, &b.ends, &b.edge_count, &b.spin,
                                    &impl_->contact_v, &impl_->impulse, &impl_->impulse_before})
        numbers += a->size();
    for (const auto& w : impl_->work)
        for (const AlignedDoubles* a :
             {&w->v, &w->v_try, &w->gradient, &w->gradient_try, &w->weight, &w->target, &w->direction, &w->frames,
              &w->frames_try, &w->edges, &w->joints, &w->ends, &w->strains, &w->band, &w->band_new})
            numbers += a->size();
    impl_->stats.bytes = numbers * sizeof(double);
    return impl_->stats;
}
void RodSimulation::reset_stats() { impl_->stats = {}; }
std::span<const RodConvergence> RodSimulation::convergence() const { return impl_->convergence; }

std::vector<std::byte> RodSimulation::save() const {
    const RodBlocks& b = impl_->blocks;
    std::vector<std::byte> out(state_size(b));
    std::byte* p = out.data();
    const auto put = [&](const void* from, std::size_t n) {
        std::memcpy(p, from, n);
        p += n;
    };
    const Header header{.numbers = b.x.size(), .rows = b.frames.size(), .strands = strand_count(), .time = impl_->time};
    put(&header, sizeof(header));
    for (const AlignedDoubles* a : {&b.x, &b.v, &b.frames, &b.ends}) put(a->data(), a->size() * sizeof(double));
    for (const RodShape& shape : b.shapes)
        for (const RodEndState* e : {&shape.root, &shape.tip})
            for (const Double3* v : {&e->position, &e->tangent, &e->director, &e->span, &e->target, &e->turn})
                put(v->data(), sizeof(Double3));
    return out;
}

Result<void> RodSimulation::restore(std::span<const std::byte> state) {
    RodBlocks& b = impl_->blocks;
    Header header;
    if (state.size() != state_size(b)) return bad("state", "is not a state of these strands");
    std::memcpy(&header, state.data(), sizeof(header));
    if (header.magic != Header{}.magic || header.numbers != b.x.size() || header.rows != b.frames.size() ||
        header.strands != strand_count())
        return bad("state", "is not a state of these strands");
    const std::byte* p = state.data() + sizeof(header);
    const auto possible = [](double v) { return std::abs(v) <= kLargestNumber; };
    bool all_possible = possible(header.time);
    for (const std::byte* at = p; at < state.data() + state.size(); at += sizeof(double)) {
        double number;
        std::memcpy(&number, at, sizeof(number));
        all_possible = all_possible && possible(number);
    }
    if (!all_possible) return bad("state", "holds numbers that no simulation has");
    // Steps keep directors at unit length (0 on an edge of no length); they cannot bring one back.
    const std::byte* frames = p + (b.x.size() + b.v.size()) * sizeof(double);
    for (std::size_t s = 0; s < strand_count(); ++s)
        for (std::size_t i = 0; i < b.edge_count_of(s); ++i) {
            double square = 0;
            for (std::size_t c = 3; c < 6; ++c) {
                double number;
                std::memcpy(&number, frames + b.frame_index(s, i, c) * sizeof(number),
                            sizeof(number));
                square += number * number;
            }
            if (square > 1.001) return bad("state", "holds frames that no simulation has");
        }
    const auto get = [&](void* to, std::size_t n) {
        std::memcpy(to, p, n);
        p += n;
    };
    for (AlignedDoubles* a : {&b.x, &b.v, &b.frames, &b.ends}) get(a->data(), a->size() * sizeof(double));
    for (RodShape& shape : b.shapes)
        for (RodEndState* e : {&shape.root, &shape.tip})
            for (Double3* v : {&e->position, &e->tangent, &e->director, &e->span, &e->target, &e->turn})
                get(v->data(), sizeof(Double3));
    impl_->time = header.time;
    return {};
}

}  // namespace keratin
