// Robustness cases on the strand solver. Each strand is a guide; the runtime's defaults are used as
// they ship.
#include "runtime/formula/bend.h"
#include "runtime/rod/double3.h"
#include "runtime/simulation.h"
#include "schema/formula/frame.h"
#include "schema/formula/quaternion.h"
#include "tools/keratin-report/stability.h"
#include "tools/scenes/groom.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace keratin::report {

namespace {

constexpr double kPi = 3.14159265358979323846;
// A root that turns further than this in one step is ambiguous (and further than a right angle a jump):
// such motions are given in parts.
constexpr double kLargestTurn = 0.5;  // rad
constexpr double kLongestStep = 0.25;  // s

using V = Vec3<double>;
V v(const Double3& p) { return V(p[0], p[1], p[2]); }
Double3 d(const V& p) { return {p.x, p.y, p.z}; }

V carried(const RigidTransform& t, const Double3& p) {
    const Vec4<double> q(t.rotation[0], t.rotation[1], t.rotation[2], t.rotation[3]);
    return rotate(q, v(p)) + v(t.translation);
}

Error unsupported(const char* message) { return {ErrorCode::unsupported, "", message}; }

class StrandRun final : public StressRun {
  public:
    static Result<std::unique_ptr<StressRun>> create(const Stress& stress, int threads) {
        if (stress.root_is_free)
            return unsupported("the root of a strand is always carried; a loose strand is not expressible");
        if (stress.strands_touch)
            return unsupported("strands do not touch each other; the grid's friction and volume stand for it");
        for (const StressStrand& s : stress.strands)
            if (!s.density_scale.empty())
                return unsupported("the mass of a point follows from one density and radius a group");
        auto run = std::make_unique<StrandRun>();
        run->stress_ = stress;
        if (auto ok = run->make_groom(); !ok) return ok.error();
        if (auto ok = run->make_simulation(threads); !ok) return ok.error();
        return Result<std::unique_ptr<StressRun>>(std::move(run));
    }

    Result<void> step(const StressStep& step) override {
        const double turn = length(step.turn);
        const auto parts = static_cast<int>(
            std::max({1.0, std::ceil(turn / kLargestTurn), std::ceil(step.h / kLongestStep - 1e-9)}));
        const RigidTransform from = last_root_;
        // A jump is one: it is seen by the solver, not cut.
        const bool jump = stress_.root.path == RootPath::jump;
        // Both simulations take `share` of the step and what is prescribed then.
        const auto advance = [&](Simulation& simulation, double share, double h) -> Result<void> {
            RigidTransform now = step.root;
            if (share < 1 && !jump) {
                now.translation = add(scaled(1 - share, from.translation), scaled(share, step.root.translation));
                const double half = share * turn / 2;
                const Double3 axis = turn > 0 ? scaled(std::sin(half) / turn, step.turn) : Double3{};
                const auto q = product(Vec4<double>(axis[0], axis[1], axis[2], std::cos(half)),
                                       Vec4<double>(from.rotation[0], from.rotation[1], from.rotation[2], from.rotation[3]));
                now.rotation = {q.x, q.y, q.z, q.w};
            }
            if (auto ok = simulation.set_motion(now); !ok) return ok;
            for (std::size_t i = 0; i < step.solids.size(); ++i) {
                RigidTransform at;
                at.translation = add(scaled(1 - share, last_solids_[i]), scaled(share, step.solids[i]));
                if (auto ok = simulation.set_collider(i, at); !ok) return ok;
            }
            return simulation.step(h);
        };
        for (int k = 1; k <= parts; ++k) {
            const std::vector<std::byte> before = moves() ? save() : std::vector<std::byte>{};
            const std::uint64_t steps_before = simulation_->health().small_steps;
            if (auto ok = advance(*simulation_, static_cast<double>(k) / parts, step.h / parts); !ok) return ok;
            if (!moves()) continue;
            // The same once more, small step by small step.
            const std::uint64_t n = simulation_->health().small_steps - steps_before;
            const double small = step.h / parts / static_cast<double>(n);
            if (auto ok = finely_->load(before); !ok) return ok;
            for (std::uint64_t i = 1; i <= n; ++i) {
                const double share = i == n && k == parts ? 1 : (k - 1 + static_cast<double>(i) / static_cast<double>(n)) / parts;
                if (auto ok = advance(*finely_, share, small); !ok) return ok;
                add_work(scaled(small / step.h, subtract(step.root.translation, from.translation)),
                         subtract(add(scaled(1 - share, from.translation), scaled(share, step.root.translation)), origin()),
                         scaled(small / step.h, step.turn), small);
            }
        }
        last_root_ = step.root;
        last_solids_.assign(step.solids.begin(), step.solids.end());
        return {};
    }

    std::vector<Double3> points(std::size_t s) const override {
        std::vector<Double3> out;
        for (std::uint32_t p = 0; p < count(s); ++p) out.push_back(add(at(simulation_->guides().position, s, p), origin()));
        return out;
    }
    std::vector<Double3> velocities(std::size_t s) const override { return velocities(*simulation_, s); }
    std::vector<Double3> velocities(const Simulation& simulation, std::size_t s) const {
        std::vector<Double3> out;
        const GuideView g = simulation.guides();
        for (std::uint32_t p = 0; p < count(s); ++p)
            out.push_back(g.previous_step > 0 ? scaled(1 / g.previous_step, subtract(at(g.position, s, p), at(g.previous, s, p)))
                                              : Double3{});
        return out;
    }
    std::vector<double> masses(std::size_t s) const override {
        std::vector<double> out(count(s), 0);
        for (std::uint32_t p = 1; p < count(s); ++p)
            for (const std::uint32_t end : {p - 1, p}) out[end] += 0.5 * line_density() * rest_length(s, p);
        return out;
    }
    double root_error(std::size_t s, const RigidTransform& root) const override {
        // Both points of the carried segment, which the frame stands on.
        double most = 0;
        for (std::uint32_t p = 0; p < 2; ++p) {
            const Double3 now = add(at(simulation_->guides().position, s, p), origin());
            most = std::max(most, length(subtract(now, d(carried(root, start(s, p))))));
        }
        return most;
    }

    // In the middle of the last small step, where the velocity between two positions belongs.
    StressEnergy energy() const override {
        StressEnergy e;
        const GuideView g = simulation_->guides();
        for (std::size_t s = 0; s < stress_.strands.size(); ++s) {
            const std::vector<double> m = masses(s);
            for (std::uint32_t p = 0; p < count(s); ++p) {
                const Double3 now = at(g.position, s, p), before = at(g.previous, s, p);
                if (g.previous_step > 0) {
                    const double speed = length(subtract(now, before)) / g.previous_step;
                    e.kinetic += 0.5 * m[p] * speed * speed;
                }
                e.potential += m[p] * stress_.gravity * (now[1] + before[1]) / 2;
            }
            e.elastic += 0.5 * (bending(g.position, s) + bending(g.previous, s));
        }
        return e;
    }

    std::optional<double> work() const override {
        return moves() ? std::optional(work_) : std::nullopt;
    }

    std::uint64_t given_up() const override {
        const HealthCounters& h = simulation_->health();
        return h.strands_reset + h.roots_refused;
    }
    void spoil(std::size_t s, std::size_t vertex) override {
        const_cast<float&>(simulation_->guides().position[place(s, static_cast<std::uint32_t>(vertex), 1)]) =
            std::numeric_limits<float>::quiet_NaN();
    }
    std::vector<std::byte> save() const override { return simulation_->save(); }
    Result<void> load(std::span<const std::byte> state) override {
        if (auto ok = simulation_->load(state); !ok) return ok;
        place_inputs(simulation_->time());
        return {};
    }

  private:
    Result<void> make_groom() {
        scenes::GroomOptions options;
        Material& m = options.group.material;
        m.radius = m.radius2 = static_cast<float>(stress_.radius);
        m.density = static_cast<float>(stress_.density);
        m.youngs_modulus = static_cast<float>(stress_.youngs_modulus);
        m.poisson_ratio = static_cast<float>(stress_.poisson_ratio);
        options.group.strand.damping = {static_cast<float>(1 - std::exp(-stress_.mass_damping / 60))};
        std::vector<scenes::Line> lines;
        for (const StressStrand& s : stress_.strands) {
            // What a bake would refuse, in its words.
            if (s.rest_points.size() < 2)
                return Error{ErrorCode::input, "strands[" + std::to_string(lines.size()) + "]",
                             "has " + std::to_string(s.rest_points.size()) + " points; at least 2 are needed"};
            lines.push_back(s.rest_points);
        }
        groom_ = scenes::make_groom(lines, options);
        // The asset's positions are where strands start; its lengths and edges how they rest.
        for (std::size_t s = 0; s < stress_.strands.size(); ++s)
            for (std::uint32_t p = 0; p < count(s); ++p)
                for (std::size_t c = 0; c < 3; ++c)
                    groom_.guide_position[place(s, p, c)] = static_cast<float>(stress_.strands[s].points[p][c]);
        return {};
    }

    Result<void> make_simulation(int threads) {
        Settings settings;
        settings.gravity = {0, static_cast<float>(-stress_.gravity), 0};
        settings.threads = threads;
        settings.passes.interpolation = false;
        settings.origin = {stress_.offset[0], stress_.offset[1], stress_.offset[2]};
        // Moves that a case means as moves are no jumps, however fast.
        if (stress_.root.path != RootPath::jump) settings.teleport_distance = 0;
        place_inputs(0);
        for (const StressSolid& solid : stress_.solids) {
            Collider c;
            if (solid.kind == StressSolid::Kind::sphere)
                c.shape = SphereCollider{{0, 0, 0}, static_cast<float>(solid.radius)};
            else
                c.shape = PlaneCollider{{0, 0, 0}, {static_cast<float>(solid.normal[0]), static_cast<float>(solid.normal[1]),
                                                    static_cast<float>(solid.normal[2])}};
            c.friction = static_cast<float>(stress_.friction);
            c.motion.translation = add(solid.at, stress_.offset);
            settings.colliders.push_back(c);
        }
        auto made = Simulation::create(groom_.info, groom_.fields, settings);
        if (!made) return made.error();
        simulation_.emplace(std::move(*made));
        if (auto ok = simulation_->set_motion(last_root_); !ok) return ok;
        simulation_->reset();
        if (!moves()) return {};
        auto finely = Simulation::create(groom_.info, groom_.fields, settings);
        if (!finely) return finely.error();
        finely_.emplace(std::move(*finely));
        return {};
    }

    bool moves() const { return stress_.root.path != RootPath::still && stress_.root.path != RootPath::jump; }

    // What the roots put in between the middles of the last small step and of this one, where the
    // velocities of positions belong: the impulse that the points took up beside gravity's and
    // damping's, and its moment, times how fast the roots move there, the mean of both steps. They move
    // as one rigid body: by `way` to `place`, with `turn`, in this step. A whole step at a time would
    // miss how a blow at its start goes on in it.
    void add_work(const Double3& way, const Double3& place, const Double3& turn, double h) {
        const Double3 spin = scaled(1 / h, turn);
        const Double3 middle = subtract(place, scaled(0.5, way));
        // how fast the body moves what is at the world's origin
        const Double3 slide = subtract(scaled(1 / h, way), cross(spin, middle));
        const double between = (h + last_h_) / 2;
        Double3 impulse{}, moment{};
        std::vector<std::vector<Double3>> speeds;
        for (std::size_t s = 0; s < stress_.strands.size(); ++s) {
            speeds.push_back(velocities(*finely_, s));
            const std::vector<double> m = masses(s);
            for (std::uint32_t p = 0; p < count(s); ++p) {
                const Double3 now = speeds[s][p], last = last_speeds_.empty() ? Double3{} : last_speeds_[s][p];
                Double3 taken = add(subtract(now, last), scaled(stress_.mass_damping * between / 2, add(now, last)));
                taken[1] += stress_.gravity * between;
                taken = scaled(m[p], taken);
                impulse = add(impulse, taken);
                moment = add(moment, cross(at(finely_->guides().previous, s, p), taken));
            }
        }
        work_ += (dot(impulse, add(slide, last_slide_)) + dot(moment, add(spin, last_spin_))) / 2;
        last_speeds_ = std::move(speeds);
        last_h_ = h;
        last_slide_ = slide;
        last_spin_ = spin;
    }

    // What is prescribed, as it is at time t.
    void place_inputs(double t) {
        last_root_ = root_at(stress_.root, t);
        last_root_.translation = add(last_root_.translation, stress_.offset);
        last_solids_.clear();
        for (const StressSolid& solid : stress_.solids) last_solids_.push_back(add(place_at(solid, t), stress_.offset));
    }

    // Where the solver keeps what: strands of one size stand in lanes in their order.
    std::size_t place(std::size_t s, std::uint32_t p, std::size_t c) const {
        return vector_index(groom_.tile_first_row[s / kTileLanes] + p, 3, c, s % kTileLanes);
    }
    Double3 at(std::span<const float> tiled, std::size_t s, std::uint32_t p) const {
        return {double(tiled[place(s, p, 0)]), double(tiled[place(s, p, 1)]), double(tiled[place(s, p, 2)])};
    }
    Double3 start(std::size_t s, std::uint32_t p) const { return at(groom_.guide_position, s, p); }
    std::uint32_t count(std::size_t s) const { return groom_.guide_point_count[s]; }
    double rest_length(std::size_t s, std::uint32_t p) const {
        return double(groom_.guide_length[scalar_index(groom_.tile_first_row[s / kTileLanes] + p, s % kTileLanes)]);
    }
    double line_density() const { return stress_.density * kPi * stress_.radius * stress_.radius; }
    Double3 origin() const { return stress_.offset; }

    // The bending energy of METHODS 1.4 as the solver has it (runtime/formula/bend.h), in double: 1/2 k
    // |C|^2 a joint, with its bound on the stiffness of a joint.
    double bending(std::span<const float> tiled, std::size_t s) const {
        const double h = simulation_->guides().previous_step;
        const double stiffness = stress_.youngs_modulus * stress_.radius * stress_.radius / (4 * stress_.density);
        const RigidTransform root = simulation_->guide_root(s);
        const Vec4<double> q(root.rotation[0], root.rotation[1], root.rotation[2], root.rotation[3]);
        const std::vector<Double3>& rest = stress_.strands[s].rest_points;
        const auto edge = [&](std::uint32_t p) { return rotate(q, v(rest[p]) - v(rest[p - 1])); };
        double sum = 0;
        for (std::uint32_t i = 1; i + 1 < count(s); ++i) {
            const V r = normalize_or(edge(i), V(1, 0, 0)), target = edge(i + 1);
            const V t = normalize_or(v(at(tiled, s, i)) - v(at(tiled, s, i - 1)), r);
            const V e = normalize_or(v(at(tiled, s, i + 1)) - v(at(tiled, s, i)), t);
            const double l = rest_length(s, i + 1), half = i == 1 ? 0 : 0.5 * rest_length(s, i);
            if (l < 1e-9) continue;
            double k = joint_stiffness(stiffness, half, l);
            if (h > 0) k = std::min(k, stiffest_joint(l) / (h * h));
            const V c = e * l - minimal_turn(r, t, target);
            sum += 0.5 * line_density() * k * dot(c, c);
        }
        return sum;
    }

    Stress stress_;
    scenes::Groom groom_;
    std::optional<Simulation> simulation_;
    std::optional<Simulation> finely_;  // follows it in its small steps, where the roots move
    double work_ = 0, last_h_ = 0;      // J; s
    Double3 last_slide_{}, last_spin_{};
    std::vector<std::vector<Double3>> last_speeds_;
    RigidTransform last_root_;
    std::vector<Double3> last_solids_;
};

}  // namespace

const StressSolver& strand_stress_solver() {
    // Positions are floats: 1e-6 of a metre or of the length is what they hold (criteria_definitions say
    // it of the root), and a step's rounding grows to 1e-4 of the length in the seconds of a case.
    static const StressSolver solver{"strand", 1e-6, 100, 1e-6, 2, StrandRun::create};
    return solver;
}

}  // namespace keratin::report
