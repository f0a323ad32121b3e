#include "runtime/rod/rod_solver.h"

#include "runtime/rod/double3.h"
#include "runtime/rod/rod_energy.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace keratin {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Reference twists are followed to the nearest turn, so an end may not turn further in one go.
constexpr double kLargestTurn = kPi / 2;
// From this turn (rad) or this share of the first edge on, a strand carried rigidly with its root
// is tried as a first guess.
constexpr double kCarryTurn = 0.2, kCarryDistance = 0.5;

using Vec = Vector3<Double1>;
Vec vec(const Double3& a) { return {a[0], a[1], a[2]}; }
Double3 plain(const Vec& a) { return {a.x.v, a.y.v, a.z.v}; }

// A held end at share s of the step.
struct Pose {
    Double3 position, tangent, director;
};
Pose pose_at(const RodEndState& end, double s) {
    if (s >= 1) return {end.target, turned(end.turn, end.tangent), turned(end.turn, end.director)};
    const Double3 turn = scaled(s, end.turn);
    return {add(scaled(1 - s, end.position), scaled(s, end.target)), turned(turn, end.tangent),
            turned(turn, end.director)};
}

}  // namespace

int RodSolver::threads() const {
    return std::max(1, std::min(thread_count(r.settings), static_cast<int>(blocks.block_count())));
}

std::uint32_t RodSolver::pieces(std::size_t s) const {
    const RodShape& shape = blocks.shapes[s];
    const double turn = std::max(length(shape.root.turn), length(shape.tip.turn));
    std::uint32_t n = 1;
    while (turn > n * kLargestTurn && n < 1u << 20) n *= 2;
    return n;
}

void RodSolver::prescribe(RodWorkspace& w, std::size_t s, std::size_t vertex, const Double3& x,
                          double h) {
    for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t k = blocks.index(s, vertex, c);
        w.v[k - blocks.block_first[blocks.block[s]]] = (x[c] - blocks.x[k]) / h;
    }
}

// The angle that brings the edge's director, carried to `tangent`, to `director`.
double RodSolver::angle_to(std::size_t s, std::size_t edge, const Double3& tangent,
                           const Double3& director) {
    Double3 t, a;
    for (std::size_t c = 0; c < 3; ++c) {
        t[c] = blocks.frames[blocks.frame_index(s, edge, c)];
        a[c] = blocks.frames[blocks.frame_index(s, edge, 3 + c)];
    }
    const Vec now = transport(vec(t), vec(tangent), vec(a));
    return turn_near(now, vec(director), vec(tangent), Double1(blocks.x[blocks.index(s, edge, 3)]))
        .v;
}

void RodSolver::hold_end(RodWorkspace& w, std::size_t s, const RodEndState& end, bool root,
                         const RodPart& part) {
    const std::size_t lane = blocks.lane(s), at = root ? 0 : 6;
    const std::size_t last = blocks.edge_count_of(s);
    const Pose pose = pose_at(end, part.s1);
    for (std::size_t c = 0; c < 3; ++c) {
        w.ends[(at + c) * lanes + lane] = pose.tangent[c];
        w.ends[(at + 3 + c) * lanes + lane] = pose.director[c];
    }
    if (end.kind == RodEnd::free) return;
    prescribe(w, s, root ? 0 : last, pose.position, part.h);
    if (end.kind != RodEnd::clamped_two_points) return;
    const Double3 span = turned(scaled(part.s1, end.turn), end.span);
    prescribe(w, s, root ? 1 : last - 1, add(pose.position, span), part.h);
    const std::size_t edge = root ? 0 : last - 1;
    const std::size_t k = blocks.index(s, edge, 3);
    const double angle = angle_to(s, edge, unit(root ? span : scaled(-1, span)), pose.director);
    w.v[k - blocks.block_first[blocks.block[s]]] = (angle - blocks.x[k]) / part.h;
}

// Everything about the block that does not change while Newton iterates.
void RodSolver::prepare(RodWorkspace& w, std::size_t b, const RodPart& part) {
    const std::size_t begin = blocks.block_first[b], row = blocks.first_row(b),
                      count = blocks.rows(b);
    const std::size_t numbers = 4 * count * lanes;
    const double h = part.h;
    w.used = blocks.used_lanes(b);
    w.block.vertex_count = static_cast<std::uint32_t>(count);
    w.block.min_edge_count = blocks.min_edges[b];
    w.block.step = h;
    w.block.edge_count = blocks.edge_count.data() + b * lanes;
    w.block.spin_weight = blocks.spin.data() + b * lanes;
    w.block.x_t0 = blocks.x.data() + begin;
    w.block.v_t0 = blocks.v.data() + begin;
    w.block.free_lanes = blocks.free_lanes.data() + begin / lanes;
    std::copy_n(blocks.frames.data() + row * kRodFrame * lanes, count * kRodFrame * lanes,
                w.frames.data());
    std::copy_n(blocks.v.data() + begin, numbers, w.v.data());
    std::copy_n(blocks.ends.data() + b * 12 * lanes, 12 * lanes, w.ends.data());
    w.block.weight = w.weight.data();
    w.block.target = w.target.data();
    RodPull pull{blocks.mass.data() + begin,
                 blocks.drag.data() + begin,
                 blocks.spring.data() + begin,
                 blocks.spring_target.data() + begin,
                 blocks.force.data() + begin,
                 {},
                 {}};
    for (std::size_t c = 0; c < 3; ++c) {
        pull.gravity[c] = r.settings.gravity[c];
        pull.air[c] = r.settings.air_velocity[c];
    }
    passes.prepare(w.block, pull, w.weight.data(), w.target.data(), w.reach.data());
    bool viscous = false;
    for (std::uint32_t l = 0; l < lanes; ++l) {
        const std::uint32_t s = blocks.strand_of_lane[b * lanes + l];
        if (s == RodBlocks::kNoLane) continue;
        const RodShape& shape = blocks.shapes[s];
        hold_end(w, s, shape.root, true, part);
        hold_end(w, s, shape.tip, false, part);
        w.dimension[l] = static_cast<double>(4 * blocks.vertex_count[s] - 1);
        viscous = viscous || shape.material.viscosity > 0;
    }
    w.block.ends = w.ends.data();
    w.block.edges = blocks.edges.data() + row * kRodEdge * lanes;
    w.block.joints = blocks.joints.data() + row * kRodJoint * lanes;
    if (viscous) add_viscosity(w, b, h);
}

// Viscosity as stiffer elements whose rest values lean to the start-of-step strains.
void RodSolver::add_viscosity(RodWorkspace& w, std::size_t b, double h) {
    const std::size_t count = w.block.vertex_count;
    const double* ends = w.block.ends;
    w.block.ends = blocks.ends.data() + b * 12 * lanes;  // as they were at the start
    passes.measure(w.block, w.frames.data(), w.strains.data());
    w.block.ends = ends;
    for (std::uint32_t l = 0; l < lanes; ++l) {
        const std::uint32_t s = blocks.strand_of_lane[b * lanes + l];
        const RodMaterial none{};
        const RodMaterial& m = s == RodBlocks::kNoLane ? none : blocks.shapes[s].material;
        // viscous over elastic stiffness
        const double bend = 3 * m.viscosity / (m.youngs_modulus * h);
        const double twist = 2 * (1 + m.poisson_ratio) * m.viscosity / (m.youngs_modulus * h);
        const auto lean = [](double rest, double start, double share) {
            return (rest + share * start) / (1 + share);
        };
        for (std::size_t i = 0; i < count; ++i) {
            const double* strain = w.strains.data() + i * kRodStrain * lanes + l;
            const double* e = w.block.edges + i * kRodEdge * lanes + l;
            double* edge = w.edges.data() + i * kRodEdge * lanes + l;
            edge[0] = e[0] * (1 + bend);
            edge[lanes] = lean(e[lanes], strain[0], bend);
            const double* j = w.block.joints + i * kRodJoint * lanes + l;
            double* joint = w.joints.data() + i * kRodJoint * lanes + l;
            joint[0] = j[0] * (1 + bend);
            joint[lanes] = j[lanes] * (1 + bend);
            joint[2 * lanes] = j[2 * lanes] * (1 + twist);
            for (std::size_t c = 0; c < 4; ++c)
                joint[(3 + c) * lanes] = lean(j[(3 + c) * lanes], strain[(1 + c) * lanes], bend);
            joint[7 * lanes] = lean(j[7 * lanes], strain[5 * lanes], twist);
        }
    }
    w.block.edges = w.edges.data();
    w.block.joints = w.joints.data();
}

// For strands whose root moves far: the velocity that carries them along rigidly, as a change of
// w.v in the direction vector. Returns the lanes.
std::uint32_t RodSolver::rigid_guess(RodWorkspace& w, std::size_t b, std::uint32_t mask,
                                     const RodPart& part) {
    std::uint32_t offered = 0;
    double* d = w.direction_rows(lanes);
    const std::size_t begin = blocks.block_first[b];
    for (std::uint32_t l = 0; l < lanes; ++l) {
        if (!has(mask, l)) continue;
        const std::uint32_t s = blocks.strand_of_lane[b * lanes + l];
        const RodShape& shape = blocks.shapes[s];
        if (shape.root.kind == RodEnd::free || shape.tip.kind != RodEnd::free) continue;
        const Double3 turn = scaled(part.s1 - part.s0, shape.root.turn);
        const Double3 to = pose_at(shape.root, part.s1).position;
        Double3 from;
        for (std::size_t c = 0; c < 3; ++c) from[c] = blocks.x[blocks.index(s, 0, c)];
        if (length(turn) < kCarryTurn &&
            length(subtract(to, from)) < kCarryDistance * shape.rest_length[0])
            continue;
        offered |= 1u << l;
        const Double3 whole = shape.root.kind == RodEnd::pinned ? Double3{0, 0, 0} : turn;
        for (std::size_t i = 0; i < blocks.vertex_count[s]; ++i) {
            Double3 x, t, a;
            for (std::size_t c = 0; c < 3; ++c) {
                x[c] = blocks.x[blocks.index(s, i, c)];
                t[c] = blocks.frames[blocks.frame_index(s, i, c)];
                a[c] = blocks.frames[blocks.frame_index(s, i, 3 + c)];
            }
            const Double3 y = add(to, turned(whole, subtract(x, from)));
            double angle = blocks.x[blocks.index(s, i, 3)];
            if (i < blocks.edge_count_of(s)) {
                const auto m = material_directors(vec(t), vec(a), Double1(angle));
                angle = angle_to(s, i, turned(whole, t), turned(whole, plain(m.m1)));
            }
            for (std::size_t c = 0; c < 4; ++c) {
                const std::size_t at = blocks.index(s, i, c), k = at - begin;
                const double now = c < 3 ? y[c] : angle;
                const bool free = has(blocks.free_lanes[at / lanes], l);
                d[k] = free ? (now - blocks.x[at]) / part.h - w.v[k] : 0;
            }
        }
    }
    return offered;
}

void RodSolver::begin(RodWorkspace& w, std::size_t b, std::uint32_t mask, const RodPart& part) {
    prepare(w, b, part);
    newton_begin(passes, w, mask);
    if (const std::uint32_t offered = rigid_guess(w, b, mask, part))
        newton_offer(passes, w, offered);
}

void RodSolver::commit(RodWorkspace& w, std::size_t b, std::uint32_t mask, const RodPart& part) {
    const std::size_t begin = blocks.block_first[b], count = blocks.rows(b);
    const bool midpoint = r.settings.integrator == RodIntegrator::midpoint;
    const std::uint32_t lost = passes.move(w.block, mask, part.h, midpoint, w.v.data(),
                                           blocks.x.data() + begin, blocks.v.data() + begin);
    w.lost |= lost;
    mask &= ~lost;
    passes.keep(count * kRodFrame, mask, w.frames.data(),
                blocks.frames.data() + blocks.first_row(b) * kRodFrame * lanes);
    passes.keep(12, mask, w.ends.data(), blocks.ends.data() + b * 12 * lanes);
    for (std::uint32_t l = 0; l < lanes; ++l) {
        if (!has(mask, l)) continue;
        const std::uint32_t s = blocks.strand_of_lane[b * lanes + l];
        const RodShape& shape = blocks.shapes[s];
        set_held(s, shape.root, 0, 1, part.s1);
        set_held(s, shape.tip, blocks.edge_count_of(s), blocks.edge_count_of(s) - 1, part.s1);
    }
    if (midpoint && mask != 0) carry_frames(w, b, mask, part);
}

// Held points stand exactly where they shall, whatever x + h v rounds to.
void RodSolver::set_held(std::size_t s, const RodEndState& end, std::size_t vertex,
                         std::size_t second, double share) {
    if (end.kind == RodEnd::free) return;
    const Double3 x = pose_at(end, share).position;
    for (std::size_t c = 0; c < 3; ++c) blocks.x[blocks.index(s, vertex, c)] = x[c];
    if (end.kind != RodEnd::clamped_two_points) return;
    const Double3 y = add(x, turned(scaled(share, end.turn), end.span));
    for (std::size_t c = 0; c < 3; ++c) blocks.x[blocks.index(s, second, c)] = y[c];
}

void RodSolver::count(const RodWorkspace& w, std::uint32_t mask, RodStepReport& report) const {
    for (std::uint32_t l = 0; l < lanes; ++l)
        if (has(mask, l)) {
            report.iterations += w.iterations[l];
            report.most_iterations = std::max(report.most_iterations, w.iterations[l]);
            report.mean_change += w.change[l];
        }
    report.indefinite += static_cast<std::uint32_t>(std::popcount(w.indefinite & mask));
}

// The midpoint rule: the strands have gone on from the middle to the end of the part, their frames
// and clamps follow.
void RodSolver::carry_frames(RodWorkspace& w, std::size_t b, std::uint32_t mask,
                             const RodPart& part) {
    const auto each_end = [&](auto&& visit) {
        for (std::uint32_t l = 0; l < lanes; ++l) {
            if (!has(mask, l)) continue;
            const std::uint32_t s = blocks.strand_of_lane[b * lanes + l];
            visit(s, blocks.shapes[s].root, true);
            visit(s, blocks.shapes[s].tip, false);
        }
    };
    each_end(
        [&](std::size_t s, const RodEndState& end, bool root) { hold_end(w, s, end, root, part); });
    std::fill_n(w.direction.data(), w.direction.size(), 0.0);
    std::fill_n(w.alpha.data(), lanes, 0.0);
    const double* none = w.direction_rows(lanes);
    passes.evaluate(w.block, none, none, w.alpha.data(), w.frames.data(), w.v_try.data(),
                    w.frames_try.data(), w.gradient_try.data(), w.energy_try.data(),
                    w.scale_try.data(), w.slope_try.data());
    passes.keep(blocks.rows(b) * kRodFrame, mask, w.frames_try.data(),
                blocks.frames.data() + blocks.first_row(b) * kRodFrame * lanes);
    passes.keep(12, mask, w.ends.data(), blocks.ends.data() + b * 12 * lanes);
    each_end([&](std::size_t s, const RodEndState& end, bool root) {
        if (end.kind != RodEnd::clamped_two_points) return;
        const Double3 span = turned(scaled(part.s1, end.turn), end.span);
        const std::size_t edge = root ? 0 : blocks.edge_count_of(s) - 1;
        blocks.x[blocks.index(s, edge, 3)] =
            angle_to(s, edge, unit(root ? span : scaled(-1, span)), pose_at(end, part.s1).director);
    });
}

void RodSolver::arrive() {
    for (RodShape& shape : blocks.shapes)
        for (RodEndState* end : {&shape.root, &shape.tip}) {
            if (end->kind == RodEnd::free) continue;
            const Pose pose = pose_at(*end, 1);
            end->position = end->target;
            end->tangent = unit(pose.tangent);
            end->director = across(pose.director, end->tangent);
            end->span = turned(end->turn, end->span);
            end->turn = {0, 0, 0};
        }
}

}  // namespace keratin
