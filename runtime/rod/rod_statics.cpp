#include "runtime/rod/rod_statics.h"

#include "runtime/rod/double3.h"
#include "runtime/rod/rod_blocks.h"
#include "runtime/rod/rod_energy.h"
#include "runtime/rod/rod_simulation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace keratin {

namespace {

using Vec = Vector3<Double1>;
Vec vec(const Double3& a) { return {a[0], a[1], a[2]}; }
Double3 plain(const Vec& a) { return {a.x.v, a.y.v, a.z.v}; }

// A shape is held when what is left unbalanced is below this share of the weight. Strains are kept
// as floats: joints near the root pass on `edges` times the weight, of which rounding is 6e-8.
constexpr double kHeld = 1e-6;
// ... and when its slowest motion has a squared frequency above this share of a pendulum's as long.
constexpr double kFirm = 1e-3;
// A strand that cannot be held is looked for a pose that can, on the way back to its shape from
// where it sags to with this share of the weight borne; that pose has to be firmer, as it is fallen
// into, and is found by kPoses halvings of the way.
constexpr double kShares[] = {0, 0.85};
constexpr double kFirmer = 5e-3;
constexpr int kPoses = 6;
// How a pose that a strand settles in is looked for: to within tolerance (m), nudged by
// perturbation (m) so that what is balanced does not stay so.
constexpr double kSettleTolerance = 1e-5, kNudge = 1e-6;

// One strand, alone in its block, as the solver holds it.
struct Alone {
    const RodPasses& passes = rod_passes(InstructionSet::baseline);
    RodBlocks blocks;

    explicit Alone(const RodStrand& strand) : blocks(make_blocks({&strand, 1}, passes.lanes)) {
        place_strand(blocks, 0, strand);
        write_strand(blocks, 0, {});
    }
    std::size_t edges() const { return blocks.edge_count_of(0); }
    Double3 edge(std::size_t j) const {
        Double3 e;
        for (std::size_t c = 0; c < 3; ++c)
            e[c] = blocks.x[blocks.index(0, j + 1, c)] - blocks.x[blocks.index(0, j, c)];
        return e;
    }
    double mass(std::size_t i) const { return blocks.mass[blocks.index(0, i, 0)]; }
    double free_mass() const {
        double sum = 0;
        for (std::size_t i = 1; i <= edges(); ++i) sum += mass(i);
        return sum;
    }
    double length() const {
        double sum = 0;
        for (const double l : blocks.shapes[0].rest_length) sum += l;
        return sum;
    }
    RodBlock block(const double* none, const double* weight) const {
        RodBlock out;
        out.vertex_count = static_cast<std::uint32_t>(edges() + 1);
        out.min_edge_count = blocks.min_edges[0];
        out.step = 1;
        out.edge_count = blocks.edge_count.data();
        out.spin_weight = blocks.spin.data();
        out.x_t0 = blocks.x.data();
        out.v_t0 = none;
        out.weight = weight;
        out.target = none;
        out.edges = blocks.edges.data();
        out.joints = blocks.joints.data();
        out.ends = blocks.ends.data();
        out.free_lanes = blocks.free_lanes.data();
        return out;
    }
};

// What is left of WeightBorne::residual.
double residual(const Alone& a, const Double3& gravity) {
    const std::size_t numbers = a.blocks.x.size(), lanes = a.passes.lanes;
    const AlignedDoubles none(numbers), alpha(lanes);
    AlignedDoubles v(numbers), gradient(numbers), frames(a.blocks.frames.size()), energy(lanes),
        scale(lanes), slope(lanes);
    const RodBlock block = a.block(none.data(), none.data());
    a.passes.evaluate(block, none.data(), none.data(), alpha.data(), a.blocks.frames.data(),
                      v.data(), frames.data(), gradient.data(), energy.data(), scale.data(),
                      slope.data());
    double worst = 0;
    for (std::size_t i = 0; i <= a.edges(); ++i) {
        Double3 force{};
        for (std::size_t c = 0; c < 3 && i > 0; ++c)
            force[c] = gradient[a.blocks.index(0, i, c)] - a.mass(i) * gravity[c];
        worst = std::max(worst, length(force));
        if (i < a.edges())
            worst = std::max(worst, std::fabs(gradient[a.blocks.index(0, i, 3)]) / a.length());
    }
    const double weight = a.free_mass() * length(gravity);
    return weight > 0 ? worst / weight : 0;
}

// Whether the Hessian less `share` g/L times the masses is positive definite. Weight has no
// Hessian.
bool stable(const Alone& a, const Double3& gravity, double share) {
    const std::size_t numbers = a.blocks.x.size(), lanes = a.passes.lanes;
    const AlignedDoubles none(numbers);
    AlignedDoubles weight(numbers), exact(lanes);
    AlignedDoubles band((numbers / lanes + 2 * kRodPadRows) * kRodBandWidth * lanes);
    const double firm = share * length(gravity) / a.length();
    for (std::size_t k = 0; k < numbers; ++k)
        weight[k] = a.blocks.inverse_mass[k] > 0 ? -firm * a.blocks.mass[k] : 0;
    std::fill_n(exact.data(), lanes, 1.0);
    double* rows = band.data() + kRodPadRows * kRodBandWidth * lanes;
    const RodBlock block = a.block(none.data(), weight.data());
    a.passes.assemble(block, none.data(), a.blocks.frames.data(), exact.data(), rows);
    return a.passes.factor(4 * std::size_t{block.vertex_count}, rows) == 0;
}

double to_float(double x) { return static_cast<float>(x); }

// The stretch of every edge under the weight beyond it: EA stretch = G.t, with G = dE/de. Masses
// follow the rest lengths, which follow the stretch: by so little that a few rounds settle it.
std::vector<Double3> stretch_edges(const Alone& a, const Double3& gravity,
                                   std::vector<RodStrain>& strain) {
    constexpr int kRounds = 4;
    const RodMaterial& m = a.blocks.shapes[0].material;
    const double area = std::numbers::pi * m.radii[0] * m.radii[1];
    const std::size_t edges = a.edges();
    std::vector<double> rest = a.blocks.shapes[0].rest_length;
    std::vector<Double3> load(edges);
    for (int round = 0; round < kRounds; ++round) {
        double beyond = 0;
        for (std::size_t j = edges; j-- > 0;) {
            beyond += m.density * area * (rest[j] + (j + 1 < edges ? rest[j + 1] : 0)) / 2;
            load[j] = scaled(beyond, gravity);
            const double stretch = dot(load[j], unit(a.edge(j))) / (m.youngs_modulus * area);
            strain[j].stretch =
                to_float(std::clamp(stretch, -kMostBorneStretch, kMostBorneStretch));
        }
        for (std::size_t j = 0; j < edges; ++j)
            rest[j] = length(a.edge(j)) / (1 + strain[j].stretch);
    }
    return load;
}

// One joint as a function of its strain.
struct BornJoint {
    Joint<Double1> joint;
    double twist = 0;  // rad, of the frames
    std::size_t index = 0;
    std::array<double, 5> rest{};  // without strain
    RodShape* shape = nullptr;     // whose rest values of the joint are written

    JointGradient<Double1> gradient(const RodStrain& strain) {
        shape->rest[index] = relieved(rest, strain);
        const auto n = joint_numbers(*shape, index, {});
        const JointMaterial<Double1> m{n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7]};
        return joint_gradient(m, joint, Double1(twist));
    }
};

using Triple = std::array<double, 3>;

// x of [column 0, 1, 2] x = right by Cramer's rule; false where it has none.
bool solve3(const std::array<Double3, 3>& column, const Double3& right, Triple& x) {
    const Double3 c = cross(column[1], column[2]);
    const double determinant = dot(column[0], c);
    x = {dot(right, c) / determinant, dot(column[0], cross(right, column[2])) / determinant,
         dot(column[0], cross(column[1], right)) / determinant};
    return std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]);
}

// Bend and twist with which the joint passes on `force` across the edge after it (dE/df) and
// `moment` about that edge (dE/dtheta): Newton's method, as far as it gets nearer.
void bear(BornJoint& j, const Double3& force, double moment, double size, RodStrain& strain) {
    constexpr int kMost = 40, kHalvings = 12;
    constexpr double kStep = 1e-6, kDone = 1e-14;
    const double length = 1 / j.joint.inverse_f.v;
    const auto off = [&](const Triple& s) {
        const JointGradient<Double1> g = j.gradient({0, {s[0], s[1]}, s[2]});
        const Double3 f = subtract(plain(g.f), force);
        return Double3{dot(f, plain(j.joint.after.m1)) * length,
                       dot(f, plain(j.joint.after.m2)) * length, g.after.v - moment};
    };
    const auto inside = [](const Triple& s) {
        return std::fabs(s[0]) < kMostBorneBend && std::fabs(s[1]) < kMostBorneBend &&
               std::fabs(s[2]) < kMostBorneTwist;
    };
    Triple s{};
    Double3 now = off(s);
    for (int round = 0; round < kMost && keratin::length(now) > kDone * size; ++round) {
        std::array<Double3, 3> column;
        for (std::size_t k = 0; k < 3; ++k) {
            Triple low = s, high = s;
            low[k] -= kStep;
            high[k] += kStep;
            column[k] = scaled(1 / (2 * kStep), subtract(off(high), off(low)));
        }
        Triple step;
        if (!solve3(column, now, step)) break;
        bool nearer = false;
        double share = 1;
        for (int halving = 0; halving < kHalvings && !nearer; ++halving, share /= 2) {
            const Triple to{s[0] - share * step[0], s[1] - share * step[1], s[2] - share * step[2]};
            if (!inside(to)) continue;
            const Double3 there = off(to);
            if (!(keratin::length(there) < keratin::length(now))) continue;
            s = to;
            now = there;
            nearer = true;
        }
        if (!nearer) break;
    }
    strain.bend = {to_float(s[0]), to_float(s[1])};
    strain.twist = to_float(s[2]);
}

// The strain that bears the weight, from the tip inwards.
std::vector<RodStrain> strain_of(const RodStrand& plain_strand, const Double3& gravity) {
    const Alone a(plain_strand);
    const RodBlocks& b = a.blocks;
    const std::size_t edges = a.edges();
    std::vector<RodStrain> out(edges);
    const std::vector<Double3> load = stretch_edges(a, gravity, out);
    RodShape shape = b.shapes[0];
    const std::vector<std::array<double, 5>> rest = shape.rest;
    relieve(out, shape);

    std::vector<Joint<Double1>> joint(edges);
    Vec t = vec(shape.root.tangent);
    Double1 inverse_before(1.0);
    auto before = material_directors(t, vec(shape.root.director), Double1(0));
    for (std::size_t i = 0; i < edges; ++i) {
        const auto at = [&](std::size_t c) { return Double1(b.frames[b.frame_index(0, i, c)]); };
        const auto e = edge_geometry(vec(a.edge(i)));
        const auto after = material_directors(e.tangent, {at(3), at(4), at(5)}, Double1(0));
        joint[i] = make_joint(t, inverse_before, before, e.tangent, e.inverse_length, after);
        t = e.tangent;
        before = after;
        inverse_before = e.inverse_length;
    }
    const double size = a.free_mass() * length(gravity) * a.length();
    Double3 force_beyond{0, 0, 0};  // of the joint at the end of the edge: dE/de, dE/dtheta
    double moment_beyond = 0;
    for (std::size_t i = edges; i-- > 0;) {
        const Double3 along = plain(joint[i].u);
        const Double3 across = subtract(load[i], scaled(dot(load[i], along), along));
        BornJoint born{joint[i], b.frames[b.frame_index(0, i, 6)], i, rest[i], &shape};
        bear(born, subtract(across, force_beyond), -moment_beyond, size, out[i]);
        const JointGradient<Double1> g = born.gradient(out[i]);
        force_beyond = plain(g.e);
        moment_beyond = g.before.v;
    }
    return out;
}

// Whether the strand, with its rest strain, is held where it is.
bool holds(const RodStrand& strand, const Double3& gravity, double share, double& left) {
    const Alone a(strand);
    left = residual(a, gravity);
    return left < kHeld && stable(a, gravity, share);
}

double farthest(std::span<const Double3> a, std::span<const Double3> b) {
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, length(subtract(a[i], b[i])));
    return most;
}

// Where the strand comes to rest.
struct Rest {
    std::vector<Double3> points;  // as far as it came; empty where that is nowhere
    bool still = false;           // it is at rest there
};
Rest settled(const RodStrand& strand, const Double3& gravity) {
    SettleOptions settle;
    settle.tolerance = kSettleTolerance;
    settle.perturbation = kNudge;
    RodSettings settings;
    settings.gravity = gravity;
    settings.threads = 1;
    settings.instruction_set = InstructionSet::baseline;
    auto rods = RodSimulation::create({&strand, 1}, settings);
    if (!rods) return {};
    const bool still = rods->settle(settle).settled;
    if (!rods->finite()) return {};
    return {rods->points(0), still};
}

// A pose between two: segments as long as those of `to`, their directions blended.
std::vector<Double3> between(std::span<const Double3> from, std::span<const Double3> to,
                             double share) {
    std::vector<Double3> out{to[0]};
    for (std::size_t i = 1; i < to.size(); ++i) {
        const Double3 a = subtract(from[i], from[i - 1]), b = subtract(to[i], to[i - 1]);
        const double l = length(b);
        const Double3 way = add(scaled((1 - share) / length(a), a), scaled(share / l, b));
        const double size = length(way);
        // opposite directions have none between
        out.push_back(add(out[i - 1], size > 1e-3 ? scaled(l / size, way) : b));
    }
    return out;
}

// The strain that gives the strand `shape` the rest shape of the strand `other` with its strain:
// the same lengths, another pose. False where it is beyond what an asset stores.
bool carry_over(const RodStrand& shape, const RodStrand& other, std::vector<RodStrain>& strain) {
    const Alone a(shape), b(other);
    const RodShape &here = a.blocks.shapes[0], &there = b.blocks.shapes[0];
    RodStrand bare = other;
    bare.rest_strain.clear();
    const Alone c(bare);
    strain = other.rest_strain;
    for (std::size_t i = 0; i < strain.size(); ++i) {
        const auto &from = here.rest[i], &to = c.blocks.shapes[0].rest[i];
        for (std::size_t k = 0; k < 2; ++k) {
            strain[i].bend[k] = to_float(strain[i].bend[k] + from[k] - to[k]);
            if (!(std::fabs(strain[i].bend[k]) <= kMostBorneBend)) return false;
        }
        strain[i].stretch = to_float(here.rest_length[i] / there.rest_length[i] - 1);
        if (!(std::fabs(strain[i].stretch) <= kMostBorneStretch)) return false;
    }
    return true;
}

}  // namespace

WeightBorne bear_weight(const RodStrand& given, const Double3& gravity) {
    RodStrand shape = given;
    shape.velocities.clear();
    shape.angles.clear();
    shape.rest_points.clear();
    shape.natural_curvature.reset();
    shape.rest_strain.clear();
    // other poses are held by the same clamp
    if (!shape.root_frame.tangent)
        shape.root_frame.tangent = unit(subtract(shape.points[1], shape.points[0]));

    WeightBorne out;
    RodStrand strand = shape;
    strand.rest_strain = out.strain = strain_of(shape, gravity);
    out.held = holds(strand, gravity, kFirm, out.residual);
    if (out.held) return out;

    // Without strain, or with a rest shape that holds the nearest pose on the way back.
    bool any = false;
    const auto offer = [&](const std::vector<RodStrain>& strain) {
        strand = shape;
        strand.rest_strain = strain;
        const Rest there = settled(strand, gravity);
        const double settles =
            there.points.empty() ? 2 * Alone(shape).length() : farthest(there.points, shape.points);
        if (any && !(there.still && settles < out.settles)) return;
        any = true;
        out.settles = settles;
        out.strain = strain;
    };
    std::vector<RodStrain> none(shape.points.size() - 1);
    offer(none);
    for (const double share : kShares) {
        strand = shape;
        if (share > 0) strand.rest_strain = strain_of(shape, scaled(share, gravity));
        const Rest sagged = settled(strand, gravity);
        if (!sagged.still) continue;
        if (share > 0) offer(strand.rest_strain);
        double reached = -1, beyond = 1;
        std::vector<RodStrain> best;
        for (int k = 0; k < kPoses; ++k) {
            const double way = reached < 0 ? 0 : 0.5 * (reached + beyond);
            RodStrand posed = shape;
            posed.points = between(sagged.points, shape.points, way);
            posed.rest_strain = strain_of(posed, gravity);
            double left = 0;
            std::vector<RodStrain> strain;
            if (holds(posed, gravity, kFirmer, left) && carry_over(shape, posed, strain)) {
                reached = way;
                best = strain;
            } else if (reached < 0) {
                break;
            } else {
                beyond = way;
            }
        }
        if (reached >= 0) offer(best);
    }
    strand = shape;
    strand.rest_strain = out.strain;
    out.residual = residual(Alone(strand), gravity);
    return out;
}

}  // namespace keratin
