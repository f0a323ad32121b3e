#include "runtime/rod/rod_step.h"

#include "runtime/rod/double3.h"
#include "runtime/rod/rod_energy.h"

#include <omp.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>

namespace keratin {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Reference twists are followed to the nearest turn, so an end may not turn further in one go.
constexpr double kLargestTurn = kPi / 2;
// From this turn (rad) or this share of the first edge on, a strand carried rigidly with its root is
// tried as a first guess.
constexpr double kCarryTurn = 0.2, kCarryDistance = 0.5;

using Vec = Vector3<Double1>;
Vec vec(const Double3& a) { return {a[0], a[1], a[2]}; }
Double3 plain(const Vec& a) { return {a.x.v, a.y.v, a.z.v}; }

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The part of the whole step from share s0 to s1 of it that is being solved.
struct Part {
    double h = 0;  // s, of the part
    double s0 = 0, s1 = 1;
};

bool has(std::uint32_t mask, std::uint32_t lane) { return (mask >> lane & 1u) != 0; }

// A held end at share s of the step.
struct Pose {
    Double3 position, tangent, director;
};
Pose pose_at(const RodEndState& end, double s) {
    if (s >= 1)
        return {end.target, turned(end.turn, end.tangent), turned(end.turn, end.director)};
    const Double3 turn = scaled(s, end.turn);
    return {add(scaled(1 - s, end.position), scaled(s, end.target)), turned(turn, end.tangent),
            turned(turn, end.director)};
}

struct Solver {
    RodStepper& r;
    const RodPasses& passes;
    RodBlocks& blocks;
    std::uint32_t lanes;

    explicit Solver(RodStepper& stepper)
        : r(stepper), passes(*stepper.passes), blocks(stepper.blocks), lanes(stepper.blocks.lanes) {}

    // No more than there are blocks: waking a thread costs more than a small block.
    int threads() const {
        return std::max(1, std::min(thread_count(r.settings), static_cast<int>(blocks.block_count())));
    }
    NewtonRules rules() const { return {r.settings.tolerance, r.settings.newton}; }

    void prescribe(RodWorkspace& w, std::size_t s, std::size_t vertex, const Double3& x, double h) {
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t k = blocks.index(s, vertex, c);
            w.v[k - blocks.block_first[blocks.block[s]]] = (x[c] - blocks.x[k]) / h;
        }
    }

    // The angle that brings the edge's director, carried to `tangent`, to `director`.
    double angle_to(std::size_t s, std::size_t edge, const Double3& tangent, const Double3& director) {
        Double3 t, a;
        for (std::size_t c = 0; c < 3; ++c) {
            t[c] = blocks.frames[blocks.frame_index(s, edge, c)];
            a[c] = blocks.frames[blocks.frame_index(s, edge, 3 + c)];
        }
        const Vec now = transport(vec(t), vec(tangent), vec(a));
        return turn_near(now, vec(director), vec(tangent), Double1(blocks.x[blocks.index(s, edge, 3)])).v;
    }

    void hold_end(RodWorkspace& w, std::size_t s, const RodEndState& end, bool root, const Part& part) {
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
    void prepare(RodWorkspace& w, std::size_t b, const Part& part) {
        const std::size_t begin = blocks.block_first[b], row = blocks.first_row(b), count = blocks.rows(b);
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
        w.reach.fill(0);
        for (std::size_t i = 0; i < 4 * count; ++i) {
            const std::size_t c = i % 4;
            for (std::size_t l = 0; l < lanes && c < 3; ++l)
                w.reach[l] = std::max(w.reach[l], std::fabs(blocks.x[begin + i * lanes + l]));
            const double g = c < 3 ? r.settings.gravity[c] : 0;
            const double air = c < 3 ? r.settings.air_velocity[c] : 0;
            for (std::size_t l = 0; l < lanes; ++l) {
                const std::size_t k = i * lanes + l, at = begin + k;
                const double m = blocks.mass[at], drag = h * blocks.drag[at];
                const double spring = h * blocks.spring[at];
                const double weight = m + drag + h * spring;
                w.weight[k] = weight;
                w.target[k] = (m * (blocks.v[at] + h * g) + drag * air + h * blocks.force[at] +
                               spring * (blocks.spring_target[at] - blocks.x[at])) /
                              weight;
            }
        }
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
    void add_viscosity(RodWorkspace& w, std::size_t b, double h) {
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
    std::uint32_t rigid_guess(RodWorkspace& w, std::size_t b, std::uint32_t mask, const Part& part) {
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

    void begin(RodWorkspace& w, std::size_t b, std::uint32_t mask, const Part& part) {
        prepare(w, b, part);
        newton_begin(passes, w, mask);
        if (const std::uint32_t offered = rigid_guess(w, b, mask, part)) newton_offer(passes, w, offered);
    }

    // The result becomes the state of the lanes in `mask`.
    void commit(RodWorkspace& w, std::size_t b, std::uint32_t mask, const Part& part) {
        const std::size_t begin = blocks.block_first[b], count = blocks.rows(b);
        const bool midpoint = r.settings.integrator == RodIntegrator::midpoint;
        const std::uint8_t* free = blocks.free_lanes.data() + begin / lanes;
        PerLane<double> sum{};
        for (std::size_t k = 0; k < 4 * count * lanes; ++k)
            sum[k % lanes] += std::fabs(w.v[k]) + std::fabs(blocks.x[begin + k]);
        for (std::uint32_t l = 0; l < lanes; ++l) {
            if (!has(mask, l) || std::isfinite(sum[l])) continue;
            mask &= ~(1u << l);
            w.lost |= 1u << l;
            for (std::size_t i = 0; i < 4 * count; ++i) blocks.v[begin + i * lanes + l] = 0;
        }
        for (std::size_t i = 0; i < 4 * count; ++i)
            for (std::uint32_t l = 0; l < lanes; ++l) {
                if (!has(mask, l)) continue;
                const std::size_t k = i * lanes + l;
                blocks.x[begin + k] += part.h * w.v[k];
                blocks.v[begin + k] = midpoint && has(free[i], l) ? 2 * w.v[k] - blocks.v[begin + k] : w.v[k];
            }
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
    void set_held(std::size_t s, const RodEndState& end, std::size_t vertex, std::size_t second, double share) {
        if (end.kind == RodEnd::free) return;
        const Double3 x = pose_at(end, share).position;
        for (std::size_t c = 0; c < 3; ++c) blocks.x[blocks.index(s, vertex, c)] = x[c];
        if (end.kind != RodEnd::clamped_two_points) return;
        const Double3 y = add(x, turned(scaled(share, end.turn), end.span));
        for (std::size_t c = 0; c < 3; ++c) blocks.x[blocks.index(s, second, c)] = y[c];
    }

    void count(const RodWorkspace& w, std::uint32_t mask, RodStepReport& report) const {
        for (std::uint32_t l = 0; l < lanes; ++l)
            if (has(mask, l)) {
                report.iterations += w.iterations[l];
                report.most_iterations = std::max(report.most_iterations, w.iterations[l]);
                report.mean_change += w.change[l];
            }
        report.indefinite += static_cast<std::uint32_t>(std::popcount(w.indefinite & mask));
    }

    // What Newton's method is asked for: the whole part, or with the midpoint rule its first half.
    Part solved(const Part& part) const {
        if (r.settings.integrator == RodIntegrator::euler) return part;
        return {part.h / 2, part.s0, (part.s0 + part.s1) / 2};
    }

    // The midpoint rule: the strands have gone on from the middle to the end of the part, their frames
    // and clamps follow.
    void carry_frames(RodWorkspace& w, std::size_t b, std::uint32_t mask, const Part& part) {
        const auto each_end = [&](auto&& visit) {
            for (std::uint32_t l = 0; l < lanes; ++l) {
                if (!has(mask, l)) continue;
                const std::uint32_t s = blocks.strand_of_lane[b * lanes + l];
                visit(s, blocks.shapes[s].root, true);
                visit(s, blocks.shapes[s].tip, false);
            }
        };
        each_end([&](std::size_t s, const RodEndState& end, bool root) { hold_end(w, s, end, root, part); });
        std::fill_n(w.direction.data(), w.direction.size(), 0.0);
        std::fill_n(w.alpha.data(), lanes, 0.0);
        const double* none = w.direction_rows(lanes);
        passes.evaluate(w.block, none, none, w.alpha.data(), w.frames.data(), w.v_try.data(), w.frames_try.data(),
                        w.gradient_try.data(), w.energy_try.data(), w.scale_try.data(), w.slope_try.data());
        passes.keep(blocks.rows(b) * kRodFrame, mask, w.frames_try.data(),
                    blocks.frames.data() + blocks.first_row(b) * kRodFrame * lanes);
        passes.keep(12, mask, w.ends.data(), blocks.ends.data() + b * 12 * lanes);
        each_end([&](std::size_t s, const RodEndState& end, bool root) {
            if (end.kind != RodEnd::clamped_two_points) return;
            const Double3 span = turned(scaled(part.s1, end.turn), end.span);
            const std::size_t edge = root ? 0 : blocks.edge_count_of(s) - 1;
            blocks.x[blocks.index(s, edge, 3)] = angle_to(s, edge, unit(root ? span : scaled(-1, span)),
                                                          pose_at(end, part.s1).director);
        });
    }

    // Solves the part of the step for the lanes in `mask`, in halves where it does not converge.
    void advance(RodWorkspace& w, std::size_t b, std::uint32_t mask, const Part& part,
                 std::uint32_t depth, RodStepReport& report) {
        begin(w, b, mask, solved(part));
        for (std::uint32_t k = 0; k < r.settings.iterations && w.running != 0; ++k)
            newton_iterate(passes, w, rules());
        count(w, mask, report);
        const std::uint32_t open = (w.running | w.failed) & mask;
        const bool last = depth >= r.settings.halvings;
        commit(w, b, last ? mask : mask & ~open, part);
        if (open == 0) return;
        if (last) {
            report.at_cap += static_cast<std::uint32_t>(std::popcount(open));
            return;
        }
        if (depth == 0) report.halved += static_cast<std::uint32_t>(std::popcount(open));
        const double middle = (part.s0 + part.s1) / 2;
        advance(w, b, open, {part.h / 2, part.s0, middle}, depth + 1, report);
        advance(w, b, open, {part.h / 2, middle, part.s1}, depth + 1, report);
    }

    // Pieces that the strand's step is cut into because an end turns far: a power of two.
    std::uint32_t pieces(std::size_t s) const {
        const RodShape& shape = blocks.shapes[s];
        const double turn = std::max(length(shape.root.turn), length(shape.tip.turn));
        std::uint32_t n = 1;
        while (turn > n * kLargestTurn && n < 1u << 20) n *= 2;
        return n;
    }

    void advance_block(RodWorkspace& w, std::size_t b, double h, RodStepReport& report) {
        std::uint32_t left = blocks.used_lanes(b);
        w.lost = 0;
        while (left != 0) {
            const auto first = static_cast<std::uint32_t>(std::countr_zero(left));
            const std::uint32_t n = pieces(blocks.strand_of_lane[b * lanes + first]);
            std::uint32_t mask = 0;
            for (std::uint32_t l = 0; l < lanes; ++l)
                if (has(left, l) && pieces(blocks.strand_of_lane[b * lanes + l]) == n) mask |= 1u << l;
            for (std::uint32_t k = 0; k < n; ++k)
                advance(w, b, mask, {h / n, double(k) / n, double(k + 1) / n}, 0, report);
            left &= ~mask;
        }
        report.lost += static_cast<std::uint32_t>(std::popcount(w.lost));
    }

    // ---- with contact: all strands together -------------------------------------------------------

    class Inverse final : public RodInverse {
      public:
        explicit Inverse(const Solver& solver) : s_(solver) {}
        std::uint64_t version(std::uint32_t b) const override { return s_.r.work[b]->version; }
        void apply_block(std::uint32_t b, std::size_t first,
                         std::span<double> values) const override {
            const std::size_t lanes = s_.lanes, rows = values.size() / (3 * lanes);
            const std::uint8_t* free =
                s_.blocks.free_lanes.data() + s_.blocks.block_first[b] / lanes;
            const std::uint32_t used = s_.blocks.used_lanes(b);
            for (std::size_t r = first; r < rows; ++r) {
                if ((free[r] & used) == used) continue;
                for (std::size_t l = 0; l < lanes; ++l)
                    for (std::size_t c = 0; c < 3 && !has(free[r], static_cast<std::uint32_t>(l));
                         ++c)
                        values[(3 * r + c) * lanes + l] = 0;
            }
            s_.passes.apply_inverse(first, rows, s_.r.work[b]->band_rows(s_.lanes), values.data());
        }
        std::size_t margin() const override { return 3 * kRodPadRows * s_.lanes; }

      private:
        const Solver& s_;
    };

    double mean_vertex_mass() const {
        double sum = 0;
        std::size_t n = 0;
        for (std::size_t s = 0; s < blocks.vertex_count.size(); ++s)
            for (std::size_t i = 0; i < blocks.vertex_count[s]; ++i) {
                const std::size_t k = blocks.index(s, i, 0);
                if (blocks.inverse_mass[k] == 0) continue;
                sum += blocks.mass[k];
                ++n;
            }
        return n > 0 ? sum / static_cast<double>(n) : 0;
    }

    ContactProblem problem(const Part& part, double whole) const {
        ContactProblem p;
        p.layout = blocks.layout();
        p.time = r.time + part.s0 * whole;
        p.step = part.h;
        for (std::size_t c = 0; c < 3; ++c) p.origin[c] = blocks.origin[c];
        p.x_t0 = blocks.x.span();
        p.v_t0 = blocks.v.span();
        p.inverse_mass = blocks.inverse_mass.span();
        p.radius = blocks.radius;
        p.spin_weight = blocks.spin_weight;
        const double g = length(r.settings.gravity);
        p.gravity_speed = g > 0 ? part.h * g : 1e-2;
        p.mean_vertex_mass = mean_vertex_mass();
        return p;
    }

    // The velocities, of running strands with the direction added.
    void gather_velocity() {
        const auto count = static_cast<std::ptrdiff_t>(blocks.block_count());
#pragma omp parallel for num_threads(threads()) schedule(static)
        for (std::ptrdiff_t b = 0; b < count; ++b) {
            RodWorkspace& w = *r.work[b];
            const std::size_t begin = blocks.block_first[b], size = blocks.block_first[b + 1] - begin;
            const double* d = w.direction_rows(lanes);
            for (std::size_t i = 0; i < size; i += lanes)
                for (std::uint32_t l = 0; l < lanes; ++l)
                    r.contact_v[begin + i + l] = w.v[i + l] + (has(w.running, l) ? d[i + l] : 0.0);
        }
    }

    // Algorithm 2 (METHODS §2.4) with the impulses inside the Newton iteration: they are found for
    // the velocity that the whole Newton step leads to, and the step is taken with them. (Taken
    // without them, it would base the next one on strands that have run into each other.)
    enum class Outcome { open, overlapping, converged };
    Outcome iterate_scene(const ContactProblem& p, RodStepReport& report) {
        // Contacts that the impulses cause are looked for every other time until there are none with
        // the velocities this near (in tolerances): geometry and impulses come to rest together, in a
        // third of the iterations that one after the other takes where hair lands on a head.
        constexpr double kNear = 1e3;
        // Impulses that the pass cannot bring under the law while the velocities stand still never
        // will be; after so many iterations this step is given up.
        constexpr std::uint32_t kIdle = 8;
        std::uint32_t idle = 0;
        bool look = true, quiet = false;
        std::uint32_t looked = 0;
        const auto count = static_cast<std::ptrdiff_t>(blocks.block_count());
        const Inverse inverse(*this);
        ContactPass pass;
        pass.mean_change = std::numeric_limits<double>::infinity();
        std::fill_n(r.impulse.data(), r.impulse.size(), 0.0);
        r.convergence.clear();
        for (std::uint32_t k = 0; k < r.settings.iterations; ++k) {
            double start = seconds();
            std::uint32_t running = 0, failed = 0;
#pragma omp parallel for num_threads(threads()) schedule(dynamic) reduction(| : running, failed)
            for (std::ptrdiff_t b = 0; b < count; ++b) {
                RodWorkspace& w = *r.work[b];
                w.change.fill(0);
                if (w.running != 0) newton_direct(passes, w, rules());
                running |= w.running;
                failed |= w.failed;
            }
            if (failed != 0) return Outcome::open;
            gather_velocity();
            r.stats.dynamics += seconds() - start;
            const bool settled = k > 0 && running == 0 && !pass.stalled && !pass.unfinished &&
                                 (pass.contacts == 0 ||
                                  pass.mean_change < r.settings.tolerance * p.mean_vertex_mass);
            idle = k > 0 && running == 0 && pass.stalled ? idle + 1 : 0;
            if (idle > kIdle) break;
            if (look || settled) {
                start = seconds();
                const std::size_t added = r.contact->detect(p, r.contact_v.span());
                r.stats.collision_detection += seconds() - start;
                looked = k;
                quiet = k > 0 && added == 0;
                if (settled && added == 0) {
                    report.contacts = static_cast<std::uint32_t>(pass.contacts);
                    report.mean_impulse_change = pass.contacts == 0 ? 0 : pass.mean_change;
                    return r.contact->overlaps() ? Outcome::overlapping : Outcome::converged;
                }
            }
            start = seconds();
            std::swap(r.impulse, r.impulse_before);
            pass = r.contact->pass(p, r.contact_v.span(), inverse, r.impulse.span());
            r.stats.impulse_solve += seconds() - start;
            start = seconds();
            double change = 0;
#pragma omp parallel for num_threads(threads()) schedule(dynamic) reduction(| : failed)
            for (std::ptrdiff_t b = 0; b < count; ++b) {
                RodWorkspace& w = *r.work[b];
                const std::size_t begin = blocks.block_first[b], end = blocks.block_first[b + 1];
                for (std::size_t i = begin; i < end; ++i) r.impulse_before[i] = r.impulse[i] - r.impulse_before[i];
                newton_push(passes, w, r.impulse_before.data() + begin);
                if (w.running == 0) continue;
                newton_redirect(passes, w);
                newton_take(passes, w, rules());
                failed |= w.failed;
            }
            for (std::ptrdiff_t b = 0; b < count; ++b)
                for (std::uint32_t l = 0; l < lanes; ++l) change += r.work[b]->change[l];
            report.mean_change = change / static_cast<double>(std::max<std::size_t>(1, blocks.first.size()));
            r.convergence.push_back({report.mean_change, pass.mean_change});
            const bool nearer = report.mean_change < kNear * r.settings.tolerance;
            quiet = quiet && nearer;
            look = !quiet && k > looked;
            ++report.contact_iterations;
            r.stats.dynamics += seconds() - start;
            if (failed != 0) return Outcome::open;
        }
        report.contacts = static_cast<std::uint32_t>(pass.contacts);
        report.mean_impulse_change = pass.mean_change;
        return Outcome::open;
    }

    void advance_scene(const Part& part, double whole, std::uint32_t depth, RodStepReport& report) {
        const auto count = static_cast<std::ptrdiff_t>(blocks.block_count());
        double start = seconds();
#pragma omp parallel for num_threads(threads()) schedule(dynamic)
        for (std::ptrdiff_t b = 0; b < count; ++b)
            begin(*r.work[b], b, blocks.used_lanes(b), part);
        r.stats.prepare += seconds() - start;
        const ContactProblem p = problem(part, whole);
        r.contact->begin_step(p);
        const Outcome outcome = iterate_scene(p, report);
        std::uint32_t failed = 0;
        for (std::ptrdiff_t b = 0; b < count; ++b) failed |= r.work[b]->failed;
        const RodSettings& settings = r.settings;
        const std::uint32_t limit = failed != 0                       ? settings.halvings
                                    : outcome == Outcome::overlapping ? settings.overlap_halvings
                                                                      : settings.contact_halvings;
        if (outcome != Outcome::converged && depth < std::min(limit, r.settings.halvings)) {
            if (depth == 0) report.halved = static_cast<std::uint32_t>(blocks.first.size());
            const double middle = (part.s0 + part.s1) / 2;
            advance_scene({part.h / 2, part.s0, middle}, whole, depth + 1, report);
            advance_scene({part.h / 2, middle, part.s1}, whole, depth + 1, report);
            return;
        }
        if (outcome == Outcome::open) {
            report.at_cap = static_cast<std::uint32_t>(blocks.first.size());
            for (std::ptrdiff_t b = 0; b < count; ++b) r.work[b]->running = 0;
            gather_velocity();
        }
        r.contact->end_step(p, r.contact_v.span());
        start = seconds();
        for (std::ptrdiff_t b = 0; b < count; ++b) Solver::count(*r.work[b], r.work[b]->used, report);
#pragma omp parallel for num_threads(threads()) schedule(dynamic)
        for (std::ptrdiff_t b = 0; b < count; ++b)
            commit(*r.work[b], b, r.work[b]->used, part);
        r.stats.prepare += seconds() - start;
    }

    // The held ends have arrived.
    void arrive() {
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
};

}  // namespace

int thread_count(const RodSettings& settings) {
    return settings.threads > 0 ? settings.threads : omp_get_max_threads();
}

void lay_out_work(RodStepper& r) {
    RodBlocks& b = r.blocks;
    std::size_t longest = 0;
    for (std::size_t k = 0; k < b.block_count(); ++k) longest = std::max(longest, b.rows(k));
    r.work.clear();
    if (r.contact != nullptr) {
        r.contact->attached();
        for (std::size_t k = 0; k < b.block_count(); ++k)
            r.work.push_back(std::make_unique<RodWorkspace>(b.rows(k), b.lanes));
    } else
        for (int k = 0; k < thread_count(r.settings); ++k)
            r.work.push_back(std::make_unique<RodWorkspace>(longest, b.lanes));
    const std::size_t numbers = r.contact != nullptr ? b.x.size() : 0;
    r.contact_v = AlignedDoubles(numbers);
    r.impulse = AlignedDoubles(numbers);
    r.impulse_before = AlignedDoubles(numbers);
    r.convergence.reserve(r.settings.iterations);
    r.block_report.resize(b.block_count());
}

RodStepReport take_step(RodStepper& r, double h) {
    Solver solver(r);
    RodStepReport report;
    const auto count = static_cast<std::ptrdiff_t>(r.blocks.block_count());
    if (r.contact != nullptr) {
        std::uint32_t n = 1;
        for (std::size_t s = 0; s < r.blocks.shapes.size(); ++s) n = std::max(n, solver.pieces(s));
        for (auto& w : r.work) w->lost = 0;
        for (std::uint32_t k = 0; k < n; ++k)
            solver.advance_scene({h / n, double(k) / n, double(k + 1) / n}, h, 0, report);
        for (const auto& w : r.work) report.lost += static_cast<std::uint32_t>(std::popcount(w->lost));
    } else {
        const double start = seconds();
#pragma omp parallel for num_threads(solver.threads()) schedule(dynamic)
        for (std::ptrdiff_t b = 0; b < count; ++b) {
            r.block_report[b] = {};
            solver.advance_block(*r.work[omp_get_thread_num()], b, h, r.block_report[b]);
        }
        for (const RodStepReport& part : r.block_report) {
            report.iterations += part.iterations;
            report.most_iterations = std::max(report.most_iterations, part.most_iterations);
            report.halved += part.halved;
            report.at_cap += part.at_cap;
            report.indefinite += part.indefinite;
            report.lost += part.lost;
            report.mean_change += part.mean_change;
        }
        report.mean_change /= static_cast<double>(std::max<std::size_t>(1, r.blocks.first.size()));
        r.stats.dynamics += seconds() - start;
    }
    solver.arrive();
    r.time += h;
    ++r.stats.steps;
    r.stats.strand_iterations += report.iterations;
    r.stats.steps_at_cap += report.at_cap > 0;
    r.stats.steps_halved += report.halved > 0;
    return report;
}

}  // namespace keratin
