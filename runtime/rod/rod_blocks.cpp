#include "runtime/rod/rod_blocks.h"

#include "runtime/rod/double3.h"
#include "runtime/rod/rod_energy.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <numeric>

namespace keratin {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Rest curvature of a joint below which (phi/omega)^2 = 1 - omega^2/6 is 1 to rounding.
constexpr double kStraight = 1e-8;

using Vec = Vector3<Double1>;
Vec vec(const Double3& a) { return {a[0], a[1], a[2]}; }
Double3 plain(const Vec& a) { return {a.x.v, a.y.v, a.z.v}; }
Double3 carried(const Double3& from, const Double3& to, const Double3& a) {
    return plain(transport(vec(from), vec(to), vec(a)));
}

bool clamps(RodEnd kind) { return kind == RodEnd::clamped; }

// Voronoi length of joint i; only joints that a clamp or two edges make have one.
double joint_length(const RodShape& shape, std::size_t i) {
    const std::size_t edges = shape.rest_length.size();
    if (i == 0) return clamps(shape.root.kind) ? shape.rest_length[0] / 2 : 0;
    if (i == edges) return clamps(shape.tip.kind) ? shape.rest_length[edges - 1] / 2 : 0;
    return (shape.rest_length[i - 1] + shape.rest_length[i]) / 2;
}

// A normal that is perpendicular to the tangent and unit, from one that may be missing or parallel.
Double3 normal_across(const std::optional<Double3>& wanted, const Double3& tangent) {
    if (wanted) {
        const Double3 n = unit(*wanted);
        if (length(subtract(n, scaled(dot(n, tangent), tangent))) > 1e-6) return across(n, tangent);
    }
    return any_normal(tangent);
}

// An edge that lies exactly on the one before has no side to open to, and its bend no energy. Where
// the rest shape is another, such a fold begins opened to one side by kOpened.
void open_folds(RodBlocks& b, std::size_t s) {
    constexpr double kOpened = 1e-3;  // rad
    const auto edge = [&](std::size_t j) {
        Double3 e;
        for (std::size_t c = 0; c < 3; ++c)
            e[c] = b.x[b.index(s, j + 1, c)] - b.x[b.index(s, j, c)];
        return e;
    };
    for (std::size_t i = 1; i < b.edge_count_of(s); ++i) {
        const Double3 t = unit(edge(i - 1)), e = edge(i), u = unit(e);
        if (1 + dot(t, u) > kOpened * kOpened / 2) continue;
        const Double3 aside = scaled(kOpened * length(e), any_normal(u));
        for (std::size_t c = 0; c < 3; ++c) b.x[b.index(s, i + 1, c)] += aside[c];
    }
}

// The bend energy is a square in omega = 2 tan(phi/2) where the material's is one in the angle phi: to
// straighten a joint that rests bent by phi takes B/(2 l) omega^2 instead of B/(2 l) phi^2. **Beyond**
// METHODS §2.2: a joint's stiffness is multiplied by (phi/omega)^2, so that a rod as long as the material
// is straightened by the material's work. About the rest bend itself it is stiffer than the material,
// by phi^2/3; 1/(1 + omega^2/4)^2 would be exact there and give way where weight pulls curls straight:
// bend-twist thresholds at 20 edges are off by at most 1 % with this factor for Gamma 20 to 1 000 and
// any Poisson's ratio, by 0.4 to 11 % with that one, by -2.6 to 0.3 % without any.
double rest_stiffness(const std::array<double, 5>& rest) {
    const double omega = std::sqrt(rest[0] * rest[0] + rest[1] * rest[1]);
    if (omega < kStraight) return 1;
    const double ratio = 2 * std::atan(omega / 2) / omega;
    return ratio * ratio;
}

}  // namespace

void AlignedDoubles::Free::operator()(double* p) const {
    ::operator delete(p, std::align_val_t{64});
}

AlignedDoubles::AlignedDoubles(std::size_t count)
    : data_(static_cast<double*>(::operator new(count * sizeof(double) + 64, std::align_val_t{64}))),
      size_(count) {
    std::fill_n(data_.get(), count, 0.0);
}

std::uint32_t RodBlocks::used_lanes(std::size_t b) const {
    std::uint32_t used = 0;
    for (std::uint32_t l = 0; l < lanes; ++l)
        if (strand_of_lane[b * lanes + l] != kNoLane) used |= 1u << l;
    return used;
}

void rest_from_points(std::span<const Double3> points, RodShape& shape) {
    const std::size_t edges = points.size() - 1;
    shape.rest_length.resize(edges);
    shape.rest.assign(points.size(), {0, 0, 0, 0, 0});
    Double3 before = shape.root.tangent, director = shape.root.director;
    for (std::size_t i = 0; i <= edges; ++i) {
        Double3 after = shape.tip.tangent;
        if (i < edges) {
            const Double3 edge = subtract(points[i + 1], points[i]);
            shape.rest_length[i] = length(edge);
            after = unit(edge);
        }
        if (i == 0 && !clamps(shape.root.kind)) {
            director = carried(before, after, director);
        } else if (i < edges || clamps(shape.tip.kind)) {
            const Double3 next = carried(before, after, director);
            const auto j = make_joint(
                vec(before), Double1(1), material_directors(vec(before), vec(director), Double1(0)),
                vec(after), Double1(1), material_directors(vec(after), vec(next), Double1(0)));
            shape.rest[i] = {j.w1_before.v, j.w2_before.v, j.w1_after.v, j.w2_after.v, 0};
            director = next;
        }
        before = after;
    }
}

void rest_from_curvature(const std::array<double, 2>& curvature, double twist, RodShape& shape) {
    shape.rest.assign(shape.rest_length.size() + 1, {0, 0, 0, 0, 0});
    const Double3 darboux{curvature[0], curvature[1], twist};
    for (std::size_t i = 0; i < shape.rest.size(); ++i) {
        // the frame of the edge before, and that frame turned by the curve's own turn over the joint
        const double l = joint_length(shape, i);
        const Double3 t{0, 0, 1}, m1{1, 0, 0};
        const Double3 u = turned(scaled(l, darboux), t), d = turned(scaled(l, darboux), m1);
        const auto j = make_joint(vec(t), Double1(1), material_directors(vec(t), vec(m1), Double1(0)), vec(u),
                                  Double1(1), material_directors(vec(u), vec(d), Double1(0)));
        const Vec carry = transport(vec(t), vec(u), vec(m1));
        shape.rest[i] = {j.w1_before.v, j.w2_before.v, j.w1_after.v, j.w2_after.v,
                         turn_near(carry, vec(d), vec(u), Double1(l * twist)).v};
    }
}

std::array<double, 5> relieved(const std::array<double, 5>& rest, const RodStrain& strain) {
    const double sine = std::sin(strain.twist / 2), cosine = std::cos(strain.twist / 2);
    // the edge before the joint turns by half of -twist, the edge after it by half of twist
    const auto turn = [&](std::size_t edge, double side, std::array<double, 5>& out) {
        const double a = rest[edge] - strain.bend[0], b = rest[edge + 1] - strain.bend[1];
        out[edge] = cosine * a - side * b;
        out[edge + 1] = side * a + cosine * b;
    };
    std::array<double, 5> out = rest;
    turn(0, -sine, out);
    turn(2, sine, out);
    out[4] -= strain.twist;
    return out;
}

void relieve(std::span<const RodStrain> strain, RodShape& shape) {
    for (std::size_t i = 0; i < strain.size(); ++i) {
        shape.rest_length[i] /= 1 + strain[i].stretch;
        shape.rest[i] = relieved(shape.rest[i], strain[i]);
    }
}

RodBlocks make_blocks(std::span<const RodStrand> strands, std::uint32_t lanes) {
    RodBlocks b;
    b.lanes = lanes;
    const std::size_t count = strands.size();
    b.first.resize(count);
    b.vertex_count.resize(count);
    b.block.resize(count);
    b.radius.resize(count);
    b.spin_weight.resize(count);
    b.shapes.resize(count);
    if (count > 0) b.origin = strands[0].points[0];

    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t p, std::uint32_t q) {
        return strands[p].points.size() < strands[q].points.size();
    });
    b.block_first.push_back(0);
    for (std::size_t begin = 0; begin < count; begin += lanes) {
        const std::size_t end = std::min<std::size_t>(count, begin + lanes);
        const auto blk = static_cast<std::uint32_t>(b.block_first.size() - 1);
        const std::size_t longest = strands[order[end - 1]].points.size();
        b.min_edges.push_back(static_cast<std::uint32_t>(strands[order[begin]].points.size() - 1));
        for (std::size_t k = begin; k < begin + lanes; ++k) {
            b.strand_of_lane.push_back(k < end ? order[k] : RodBlocks::kNoLane);
            if (k >= end) continue;
            const std::uint32_t s = order[k];
            b.block[s] = blk;
            b.first[s] = b.block_first[blk] + static_cast<std::uint32_t>(k - begin);
            b.vertex_count[s] = static_cast<std::uint32_t>(strands[s].points.size());
        }
        if (end < begin + lanes) b.min_edges.back() = 0;  // empty lanes have virtual edges only
        b.block_first.push_back(b.block_first[blk] + static_cast<std::uint32_t>(4 * longest * lanes));
    }
    const std::size_t numbers = b.block_first.back(), rows = numbers / (4 * lanes);
    for (AlignedDoubles* a : {&b.x, &b.v, &b.mass, &b.inverse_mass, &b.force, &b.spring,
                              &b.spring_target, &b.drag})
        *a = AlignedDoubles(numbers);
    b.free_lanes.assign(4 * rows, 0);
    b.frames = AlignedDoubles(rows * kRodFrame * lanes);
    b.edges = AlignedDoubles(rows * kRodEdge * lanes);
    b.joints = AlignedDoubles(rows * kRodJoint * lanes);
    b.ends = AlignedDoubles(b.block_count() * 12 * lanes);
    b.edge_count = AlignedDoubles(b.block_count() * lanes);
    b.spin = AlignedDoubles(b.block_count() * lanes);

    // virtual edges and empty lanes: unit tangents, no stiffness
    std::fill_n(b.mass.data(), numbers, 1.0);
    for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t l = 0; l < lanes; ++l) {
            b.frames[(r * kRodFrame + 0) * lanes + l] = 1;
            b.frames[(r * kRodFrame + 4) * lanes + l] = 1;
            b.edges[(r * kRodEdge + 1) * lanes + l] = 1;
        }
    for (std::size_t k = 0; k < b.block_count(); ++k)
        for (std::size_t l = 0; l < lanes; ++l)
            for (const std::size_t c : {0, 4, 6, 10}) b.ends[(k * 12 + c) * lanes + l] = 1;
    return b;
}

std::array<double, kRodJoint> joint_numbers(const RodShape& shape, std::size_t i,
                                            const RodScales& scales) {
    const RodMaterial& m = shape.material;
    const double r1 = m.radii[0], r2 = m.radii[1];
    const double shear = m.youngs_modulus / (2 * (1 + m.poisson_ratio));
    const double bend1 = scales.bend * m.youngs_modulus * kPi * r1 * r1 * r1 * r2 / 4;
    const double bend2 = scales.bend * m.youngs_modulus * kPi * r1 * r2 * r2 * r2 / 4;
    const double twist =
        scales.twist * shear * kPi * r1 * r1 * r1 * r2 * r2 * r2 / (r1 * r1 + r2 * r2);
    const double l = joint_length(shape, i);
    const double per = l > 0 ? 1 / l : 0;
    const std::array<double, 5>& rest = shape.rest[i];
    const double per_length = per * rest_stiffness(rest);
    return {bend1 * per_length / 2,
            bend2 * per_length / 2,
            twist * per_length,
            rest[0],
            rest[1],
            rest[2],
            rest[3],
            rest[4]};
}

void write_strand(RodBlocks& b, std::size_t s, const RodScales& scales) {
    const RodShape& shape = b.shapes[s];
    const RodMaterial& m = shape.material;
    const std::size_t edges = shape.rest_length.size();
    const double r1 = m.radii[0], r2 = m.radii[1];
    const double area = kPi * r1 * r2;
    const double stretch = scales.stretch * m.youngs_modulus * area;
    b.radius[s] = std::max(r1, r2);
    b.spin_weight[s] = std::sqrt((r1 * r1 + r2 * r2) / 2);
    b.edge_count[b.block[s] * b.lanes + b.lane(s)] = static_cast<double>(edges);
    b.spin[b.block[s] * b.lanes + b.lane(s)] = b.spin_weight[s];

    const std::uint8_t bit = static_cast<std::uint8_t>(1u << b.lane(s));
    const std::size_t row = 4 * b.first_row(b.block[s]);
    for (std::size_t i = 0; i <= edges; ++i) {
        const double before = i > 0 ? shape.rest_length[i - 1] : 0;
        const double after = i < edges ? shape.rest_length[i] : 0;
        const double length_here = (before + after) / 2;
        const double added = shape.added_mass.empty() ? 0 : shape.added_mass[i];
        const double mass = m.density * area * length_here + added;
        const double inertia = i < edges ? m.density * area * after * (r1 * r1 + r2 * r2) / 4 : 1;
        const bool root_holds = (i == 0 && shape.root.kind != RodEnd::free) ||
                                (i == 1 && shape.root.kind == RodEnd::clamped_two_points);
        const bool tip_holds = (i == edges && shape.tip.kind != RodEnd::free) ||
                               (i + 1 == edges && shape.tip.kind == RodEnd::clamped_two_points);
        const bool angle_held = i == edges ||
                                (i == 0 && shape.root.kind == RodEnd::clamped_two_points) ||
                                (i + 1 == edges && shape.tip.kind == RodEnd::clamped_two_points);
        for (std::size_t c = 0; c < 4; ++c) {
            const bool held = c < 3 ? root_holds || tip_holds : angle_held;
            const double value = c < 3 ? mass : inertia;
            b.mass[b.index(s, i, c)] = value;
            b.inverse_mass[b.index(s, i, c)] = held ? 0 : 1 / value;
            b.drag[b.index(s, i, c)] = c < 3 ? m.air_drag * length_here : 0;
            std::uint8_t& mask = b.free_lanes[row + 4 * i + c];
            mask = static_cast<std::uint8_t>(held ? mask & ~bit : mask | bit);
        }
        if (i < edges) {
            b.edges[b.edge_index(s, i, 0)] = stretch / after;
            b.edges[b.edge_index(s, i, 1)] = after;
        }
        const auto joint = joint_numbers(shape, i, scales);
        for (std::size_t c = 0; c < kRodJoint; ++c) b.joints[b.joint_index(s, i, c)] = joint[c];
    }
}

void reset_frames(RodBlocks& b, std::size_t s) {
    const RodShape& shape = b.shapes[s];
    const std::size_t edges = shape.rest_length.size();
    Double3 before = shape.root.tangent, director = shape.root.director;
    const std::size_t rows = b.rows(b.block[s]);
    for (std::size_t i = 0; i < rows; ++i) {
        Double3 after = shape.tip.tangent;
        if (i < edges) {
            Double3 edge;
            for (std::size_t c = 0; c < 3; ++c)
                edge[c] = b.x[b.index(s, i + 1, c)] - b.x[b.index(s, i, c)];
            after = unit(edge);
            director = carried(before, after, director);
            before = after;
        }
        const Double3 a = i < edges ? director : shape.tip.director;
        double reference = 0;
        if (i == edges) {
            const Double3 carry = carried(before, after, director);
            reference = turn_near(vec(carry), vec(a), vec(after), Double1(0)).v;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            b.frames[b.frame_index(s, i, c)] = after[c];
            b.frames[b.frame_index(s, i, 3 + c)] = a[c];
        }
        b.frames[b.frame_index(s, i, 6)] = reference;
    }
    for (std::size_t c = 0; c < 3; ++c) {
        b.ends[b.end_index(s, c)] = shape.root.tangent[c];
        b.ends[b.end_index(s, 3 + c)] = shape.root.director[c];
        b.ends[b.end_index(s, 6 + c)] = shape.tip.tangent[c];
        b.ends[b.end_index(s, 9 + c)] = shape.tip.director[c];
    }
}

void place_strand(RodBlocks& b, std::size_t s, const RodStrand& strand) {
    RodShape& shape = b.shapes[s];
    shape.material = strand.material;
    shape.added_mass = strand.added_mass;
    const auto& rest = strand.rest_points.empty() ? strand.points : strand.rest_points;
    const std::size_t last = strand.points.size() - 1;
    for (std::size_t i = 0; i <= last; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            b.x[b.index(s, i, c)] = strand.points[i][c] - b.origin[c];
            if (!strand.velocities.empty()) b.v[b.index(s, i, c)] = strand.velocities[i][c];
        }
    for (std::size_t j = 0; j < strand.angles.size(); ++j) b.x[b.index(s, j, 3)] = strand.angles[j];

    if (!strand.rest_points.empty()) open_folds(b, s);
    // the root's frame; of a free root that of the first rest edge
    const Double3 first = unit(subtract(rest[1], rest[0]));
    shape.root.kind = strand.root;
    shape.root.tangent = strand.root == RodEnd::clamped && strand.root_frame.tangent
                             ? unit(*strand.root_frame.tangent)
                             : first;
    shape.root.director = normal_across(strand.root_frame.normal, shape.root.tangent);
    shape.tip.kind = strand.tip;
    shape.tip.tangent = strand.tip == RodEnd::clamped && strand.tip_frame.tangent
                            ? unit(*strand.tip_frame.tangent)
                            : unit(subtract(rest[last], rest[last - 1]));
    rest_from_points(rest, shape);
    if (strand.natural_curvature)
        rest_from_curvature(*strand.natural_curvature, strand.natural_twist, shape);
    relieve(strand.rest_strain, shape);

    shape.tip.director = any_normal(shape.tip.tangent);
    reset_frames(b, s);
    // without a normal of its own the tip is clamped as it comes, without twist
    if (strand.tip_frame.normal) {
        shape.tip.director = normal_across(strand.tip_frame.normal, shape.tip.tangent);
    } else {
        const auto frame = [&](std::size_t from) {
            const auto at = [&](std::size_t c) {
                return b.frames[b.frame_index(s, last - 1, from + c)];
            };
            return Vec{at(0), at(1), at(2)};
        };
        const Directors<Double1> directors =
            material_directors(frame(0), frame(3), Double1(b.x[b.index(s, last - 1, 3)]));
        shape.tip.director = plain(transport(frame(0), vec(shape.tip.tangent), directors.m1));
    }
    reset_frames(b, s);
}

}  // namespace keratin
