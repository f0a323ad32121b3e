#include "tools/keratin-report/stability.h"

#include "runtime/rod/double3.h"
#include "tools/keratin-report/elastica.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <random>

namespace keratin::report {

namespace {

constexpr double kPi = 3.14159265358979323846;
// criteria_definitions: what counts as standing still, and the energy's rounding.
constexpr double kStill = 1e-3;       // m/s
constexpr double kEnergyShare = 1e-6;  // of |E(0)| + m g L

double thread_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// The steps of a run: fixed, or drawn log-uniformly.
class Clock {
  public:
    explicit Clock(const Stress& s) : stress_(s), random_(s.seed) {}
    double next() {
        if (stress_.longest <= 0) return stress_.step;
        // 53 bits of the generator, so that every library draws the same
        const double u = static_cast<double>(random_() >> 11) * 0x1p-53;
        return stress_.shortest * std::pow(stress_.longest / stress_.shortest, u);
    }

  private:
    const Stress& stress_;
    std::mt19937_64 random_;
};

RigidTransform shifted(RigidTransform t, const Double3& by) {
    for (std::size_t c = 0; c < 3; ++c) t.translation[c] += by[c];
    return t;
}

// A run with its time, so that prescribed things follow.
struct Trial {
    const Stress* stress;
    std::unique_ptr<StressRun> run;
    Clock clock;
    double time = 0, last_cost = 0;
    std::size_t steps = 0;

    Trial(const Stress& s, std::unique_ptr<StressRun> r) : stress(&s), run(std::move(r)), clock(s) {}

    RigidTransform root() const { return shifted(root_at(stress->root, time), stress->offset); }

    Result<void> advance() {
        const double h = clock.next(), before = time;
        // whole steps are counted, not added up
        time = stress->longest > 0 ? time + h : stress->step * static_cast<double>(steps + 1);
        std::vector<Double3> solids;
        for (const StressSolid& solid : stress->solids) solids.push_back(add(place_at(solid, time), stress->offset));
        const double start = thread_seconds();
        auto done = run->step({h, root(), turn_between(stress->root, before, time), solids});
        last_cost = thread_seconds() - start;
        ++steps;
        return done;
    }
    bool over() const {
        return stress->frames ? steps >= *stress->frames : time >= stress->duration - 1e-9 * stress->step;
    }
};

// A loose strand on a plane that is too steep for its friction.
bool slips(const Stress& s) {
    if (!s.root_is_free || s.solids.empty() || s.solids[0].kind != StressSolid::Kind::plane) return false;
    const double upright = s.solids[0].normal[1];
    return s.friction < std::sqrt(std::max(0.0, 1 - upright * upright)) / upright;
}

// What is looked at after each step.
struct Extremes {
    std::size_t not_finite = 0;
    double root = 0, stretch = 0, speed = 0, penetration = 0;
    double energy_excess = -std::numeric_limits<double>::infinity();  // J over what is allowed
    double kinetic = 0;
};

class Judge {
  public:
    Judge(const StressCase& test, const StressSolver& solver)
        : test_(test), stress_(test.stress), criteria_(test.criteria), solver_(solver) {
        for (const StressStrand& strand : stress_.strands) {
            std::vector<double> lengths;
            for (std::size_t i = 1; i < strand.rest_points.size(); ++i)
                lengths.push_back(length(subtract(strand.rest_points[i], strand.rest_points[i - 1])));
            rest_lengths_.push_back(std::move(lengths));
        }
    }

    std::vector<Check> checks;

    void check(std::string what, double measured, double tolerance, double reference = 0) {
        checks.push_back({std::move(what), measured, reference, std::fabs(measured - reference), tolerance});
    }
    // A demand that is met or not: 0 is met.
    void demand(std::string what, bool met) { check(std::move(what), met ? 0 : 1, 0); }

    void begin(const Trial& t) {
        start_ = t.run->energy().total();
        momentum_ = momentum(t);
        scale_ = std::fabs(start_) + mass(t) * std::fabs(stress_.gravity) * stress_.length;
    }

    void look(const Trial& t) {
        for (std::size_t s = 0; s < stress_.strands.size(); ++s) {
            const std::vector<Double3> x = t.run->points(s), v = t.run->velocities(s);
            for (std::size_t i = 0; i < x.size(); ++i) {
                if (!is_finite(x[i]) || !is_finite(v[i])) ++worst.not_finite;
                worst.speed = std::max(worst.speed, i < solver_.prescribed ? 0.0 : length(v[i]));
            }
            worst.stretch = std::max(worst.stretch, stretch(s, x));
            if (!stress_.root_is_free) {
                const double far = std::max(1.0, length(subtract(t.root().translation, stress_.offset)));
                worst.root = std::max(worst.root, t.run->root_error(s, t.root()) / far);
            }
            if (t.time >= criteria_.penetration_from)
                worst.penetration = std::max(worst.penetration, depth(x, t.time));
        }
        watch_energy(t);
    }

    double stretch(std::size_t strand, const std::vector<Double3>& x) const {
        double most = 0;
        for (std::size_t i = 1; i < x.size(); ++i)
            most = std::max(most,
                            std::fabs(length(subtract(x[i], x[i - 1])) / rest_lengths_[strand][i - 1] - 1));
        return most;
    }

    // How deep the deepest free vertex is in a solid, m: beyond touching it with its surface.
    double depth(const std::vector<Double3>& x, double time) const {
        double most = 0;
        for (const StressSolid& solid : stress_.solids) {
            const Double3 place = add(place_at(solid, time), stress_.offset);
            for (std::size_t i = stress_.root_is_free ? 0 : solver_.prescribed; i < x.size(); ++i) {
                const Double3 d = subtract(x[i], place);
                const double distance = solid.kind == StressSolid::Kind::sphere ? length(d) - solid.radius
                                                                                : dot(d, solid.normal);
                most = std::max(most, stress_.radius - distance);
            }
        }
        return most;
    }

    double fastest(const Trial& t) const {
        double most = 0;
        for (std::size_t s = 0; s < stress_.strands.size(); ++s)
            for (const Double3& v : t.run->velocities(s)) most = std::max(most, length(v));
        return most;
    }

    // Everything but what is judged at rest.
    void conclude(const Trial& t) {
        if (criteria_.finite)
            check("not finite, or given up by the solver", static_cast<double>(worst.not_finite + t.run->given_up()), 0);
        if (criteria_.root && !stress_.root_is_free)
            check("root off its place (m or rad, per max(1, |x|))", worst.root, solver_.root_tolerance);
        if (criteria_.stretch) check("stretch", worst.stretch, *criteria_.stretch);
        if (criteria_.speed) check("speed (m/s)", worst.speed, *criteria_.speed);
        if (criteria_.penetration)
            check("penetration (radii)", worst.penetration / stress_.radius, *criteria_.penetration);
        if (criteria_.energy == Criteria::Energy::spinning)
            check("kinetic energy (J)", worst.kinetic, spinning_bound(t));
        else if (criteria_.energy != Criteria::Energy::unjudged)
            check("energy gained beyond work / (|E(0)| + m g L)", std::max(0.0, worst.energy_excess) / scale_,
                  kEnergyShare);
    }

    // At rest: the shape against the static reference, the speed, the stretch of the end.
    void conclude_rest(const Trial& t) {
        char when[64];
        std::snprintf(when, sizeof(when), " after %.4g s", t.time);
        if (criteria_.stretch) {
            double end = 0;
            for (std::size_t s = 0; s < stress_.strands.size(); ++s) end = std::max(end, stretch(s, t.run->points(s)));
            check(std::string("stretch") + when, end, *criteria_.stretch / 10);
        }
        if (!criteria_.rest) return;
        // a loose strand on a slope too steep for its friction goes on; check_slide judges how
        if (!slips(stress_)) check(std::string("speed (m/s)") + when, fastest(t), kStill);
        check(std::string("shape off its rest / L") + when, away_from_rest(t),
              std::max(*criteria_.rest, solver_.resolution));
    }

    Extremes worst;

  private:
    double mass(const Trial& t) const {
        double sum = 0;
        for (std::size_t s = 0; s < stress_.strands.size(); ++s)
            for (double m : t.run->masses(s)) sum += m;
        return sum;
    }
    double spinning_bound(const Trial& t) const {
        const double v = criteria_.spin_factor * length(stress_.root.turn) * stress_.length;
        return 0.5 * mass(t) * v * v;
    }

    // Momentum and moment of momentum about the world's origin (shifted along with `offset`).
    struct Momentum {
        Double3 along{}, about{}, place{};  // place: sum of m x
    };
    Momentum momentum(const Trial& t) const {
        Momentum p;
        for (std::size_t s = 0; s < stress_.strands.size(); ++s) {
            const std::vector<Double3> x = t.run->points(s), v = t.run->velocities(s);
            const std::vector<double> m = t.run->masses(s);
            for (std::size_t i = 0; i < x.size(); ++i) {
                const Double3 at = subtract(x[i], stress_.offset);
                p.along = add(p.along, scaled(m[i], v[i]));
                p.about = add(p.about, scaled(m[i], cross(at, v[i])));
                p.place = add(p.place, scaled(m[i], at));
            }
        }
        return p;
    }

    // The roots' work from what they changed of the momentum beside gravity and damping. They move as
    // one rigid body, so force and torque do.
    double work_of_step(const Trial& t) {
        const Momentum now = momentum(t);
        const double h = t.time - last_time_, m = mass(t);
        const RigidTransform a = root_at(stress_.root, last_time_), b = root_at(stress_.root, t.time);
        const Double3 turn = turn_between(stress_.root, last_time_, t.time);
        const Double3 middle_place = scaled(0.5, add(now.place, momentum_.place));
        const Double3 pull{0, -stress_.gravity, 0};
        const auto mean = [](const Double3& x, const Double3& y) { return scaled(0.5, add(x, y)); };
        // J = dP - M g h + c P h, and the same for the moments
        const Double3 impulse =
            add(add(subtract(now.along, momentum_.along), scaled(-m * h, pull)),
                scaled(stress_.mass_damping * h, mean(now.along, momentum_.along)));
        const Double3 angular =
            add(add(subtract(now.about, momentum_.about), scaled(-h, cross(middle_place, pull))),
                scaled(stress_.mass_damping * h, mean(now.about, momentum_.about)));
        momentum_ = now;
        const Double3 root_way = subtract(b.translation, a.translation);
        const Double3 root_place = mean(a.translation, b.translation);
        const Double3 origin_way = subtract(root_way, cross(turn, root_place));
        return h > 0 ? (dot(impulse, origin_way) + dot(angular, turn)) / h : 0;
    }

    void watch_energy(const Trial& t) {
        const StressEnergy e = t.run->energy();
        worst.kinetic = std::max(worst.kinetic, e.kinetic);
        if (criteria_.energy == Criteria::Energy::unjudged) return;
        work_ += work_of_step(t);
        last_time_ = t.time;
        if (const auto known = t.run->work()) work_ = *known;
        if (criteria_.energy == Criteria::Energy::after_first_step && t.steps == 1) start_ = e.total();
        const double excess = e.total() - start_ - work_;
        worst.energy_excess = std::max(worst.energy_excess, std::isfinite(excess) ? excess : 1e300);
    }

    // Largest distance of a vertex from the static shape, over the length. Straight strands under
    // gravity have a reference; others their own shape at the start. A loose strand may lie anywhere:
    // of it the distances between its vertices are compared.
    double away_from_rest(const Trial& t) const {
        double most = 0;
        for (std::size_t s = 0; s < stress_.strands.size(); ++s) {
            const std::vector<Double3> x = t.run->points(s);
            if (stress_.root_is_free) {
                const std::vector<Double3>& rest = stress_.strands[s].rest_points;
                for (std::size_t i = 0; i < x.size(); ++i)
                    for (std::size_t j = 0; j < i; ++j)
                        most = std::max(most, std::fabs(length(subtract(x[i], x[j])) - length(subtract(rest[i], rest[j]))));
                continue;
            }
            const std::vector<Double3> rest = rest_shape(s, t);
            for (std::size_t i = 0; i < x.size(); ++i) most = std::max(most, length(subtract(x[i], rest[i])));
        }
        return most / stress_.length;
    }

    std::vector<Double3> rest_shape(std::size_t s, const Trial& t) const {
        const StressStrand& strand = stress_.strands[s];
        const RigidTransform root = t.root();
        const Double3 spin = turn_between(stress_.root, 0, t.time);
        std::vector<Double3> out;
        const Double3 first = strand.points[0];
        for (const Double3& p : strand.rest_points)
            out.push_back(add(root.translation, turned(spin, add(first, subtract(p, strand.rest_points[0])))));
        if (stress_.gravity == 0 || !stress_.straight_at_rest) return out;
        const std::size_t clamp = solver_.prescribed - 1;
        std::vector<double> at;
        double along = 0;
        for (std::size_t i = clamp; i < out.size(); ++i) {
            if (i > clamp) along += rest_lengths_[s][i - 1];
            at.push_back(along);
        }
        const double section = kPi * stress_.radius * stress_.radius;
        const Double3 direction = unit(subtract(out[1], out[0]));
        const std::vector<Double3> free = hanging_shape(
            direction, along, stress_.density * section * stress_.gravity,
            stress_.youngs_modulus * section * stress_.radius * stress_.radius / 4, at);
        for (std::size_t i = clamp; i < out.size(); ++i) out[i] = add(out[clamp], free[i - clamp]);
        return out;
    }

    const StressCase& test_;
    const Stress& stress_;
    const Criteria& criteria_;
    const StressSolver& solver_;
    std::vector<std::vector<double>> rest_lengths_;
    double start_ = 0, work_ = 0, scale_ = 1, last_time_ = 0;
    Momentum momentum_;
};

// A simulation, or why there is none.
struct Made {
    std::unique_ptr<StressRun> run;
    std::string not_applicable, refused;
};

Made make(const Stress& stress, const StressSolver& solver, int threads = 1) {
    Made made;
    auto run = solver.create(stress, threads);
    if (run)
        made.run = std::move(*run);
    else if (run.error().code == ErrorCode::unsupported)
        made.not_applicable = to_string(run.error());
    else
        made.refused = to_string(run.error());
    return made;
}

// Steps to the end of the case. False: a step was refused, and a check says so.
bool run_to_end(Trial& trial, Judge& judge, std::vector<double>* costs) {
    while (!trial.over()) {
        if (auto done = trial.advance(); !done) {
            judge.demand("step taken: " + to_string(done.error()), false);
            return false;
        }
        judge.look(trial);
        if (costs) costs->push_back(trial.last_cost);
    }
    return true;
}

// On until everything stands still: with a damping of c per second speeds fall to 1e-4 of themselves
// in 20 / c.
void settle(Trial& trial, const Judge& judge, const Criteria& criteria) {
    const double limit = std::max(criteria.rest_at, trial.time + 20 / std::max(0.2, trial.stress->mass_damping));
    // a strand that turns back stands still for a moment only
    constexpr double kHold = 0.5;  // s
    double moved = trial.time;
    while (criteria.rest && trial.time < limit) {
        if (judge.fastest(trial) >= 0.1 * kStill) moved = trial.time;
        if (trial.time >= criteria.rest_at && trial.time > moved + kHold) return;
        if (!trial.advance()) return;
    }
}

// The dearest step over the median of an undisturbed run's; each step the cheaper of two runs, since a
// machine does other things now and then.
void check_time(const StressCase& test, const StressSolver& solver, const std::vector<double>& first, Judge& judge) {
    std::vector<double> costs = first;
    for (int again = 0; again < 2; ++again) {
        Made made = make(test.stress, solver);
        if (!made.run) return;
        Trial trial(test.stress, std::move(made.run));
        for (std::size_t i = 0; i < costs.size() && trial.advance(); ++i) costs[i] = std::min(costs[i], trial.last_cost);
    }
    Stress calm = test.stress;
    calm.solids.clear();
    calm.root = {};
    for (StressStrand& strand : calm.strands)
        for (std::size_t i = 0; i < strand.points.size(); ++i)
            strand.points[i] = {calm.length * static_cast<double>(i) / static_cast<double>(strand.points.size() - 1), 0, 0};
    for (StressStrand& strand : calm.strands) strand.rest_points = strand.points;
    Made made = make(calm, solver);
    if (!made.run) return;
    Trial trial(calm, std::move(made.run));
    std::vector<double> plain;
    for (int i = 0; i < 200 && trial.advance(); ++i) plain.push_back(trial.last_cost);
    std::ranges::sort(plain);
    judge.check("dearest step / median undisturbed step", std::ranges::max(costs) / plain[plain.size() / 2],
                *test.criteria.time);
}

// Down the plane of a strand that started at rest: the mean of its vertices' velocities.
double slide_speed(const Trial& t, const StressSolid& plane) {
    const Double3 pull{0, -1, 0};
    const Double3 down = unit(subtract(pull, scaled(dot(pull, plane.normal), plane.normal)));
    double sum = 0;
    const std::vector<Double3> v = t.run->velocities(0);
    for (const Double3& u : v) sum += dot(u, down);
    return sum / static_cast<double>(v.size());
}

void check_slide(Trial& t, Judge& judge, const Criteria& criteria) {
    if (t.stress->solids.empty()) return;
    const StressSolid& plane = t.stress->solids[0];
    if (criteria.creep) judge.check("creep (m/s)", std::fabs(slide_speed(t, plane)), *criteria.creep);
    if (!criteria.slide && !slips(*t.stress)) return;
    const double before = slide_speed(t, plane), from = t.time;
    while (t.time < from + 0.2)
        if (!t.advance()) return;
    // damping takes c v of it
    const double a = (slide_speed(t, plane) - before) / (t.time - from) +
                     t.stress->mass_damping * (slide_speed(t, plane) + before) / 2;
    const double angle = std::acos(plane.normal[1]);
    // 1 % is what the cases allow of a strand without friction
    judge.check("acceleration down the plane / (g sin a)", a / (t.stress->gravity * std::sin(angle)),
                criteria.slide.value_or(0.01), slips(*t.stress) ? 1 - t.stress->friction / std::tan(angle) : 0);
}

bool same_bits(const StressRun& a, const StressRun& b, std::size_t in_a, std::size_t in_b) {
    const std::vector<Double3> x = a.points(in_a), y = b.points(in_b);
    return x == y && a.velocities(in_a) == b.velocities(in_b);
}

bool all_same_bits(const StressRun& a, const StressRun& b, std::size_t strands) {
    for (std::size_t s = 0; s < strands; ++s)
        if (!same_bits(a, b, s, s)) return false;
    return true;
}

std::string plain_run(const StressCase& test, const StressSolver& solver, Judge& judge) {
    Made made = make(test.stress, solver);
    const bool refusing = test.criteria.reject || test.criteria.may_reject;
    if (!made.refused.empty()) {
        judge.demand((refusing ? "refused: " : "made: ") + made.refused, refusing);
        return {};
    }
    if (!made.run) {
        if (!refusing) return made.not_applicable;
        judge.demand("refused: " + made.not_applicable, true);
        return {};
    }
    if (test.criteria.reject) judge.demand("refused", false);
    Trial trial(test.stress, std::move(made.run));
    judge.begin(trial);
    std::vector<double> costs;
    if (!run_to_end(trial, judge, &costs)) return {};
    judge.conclude(trial);
    if (test.stress.root_is_free) check_slide(trial, judge, test.criteria);
    settle(trial, judge, test.criteria);
    judge.conclude_rest(trial);
    if (test.criteria.time) check_time(test, solver, costs, judge);
    return {};
}

// No drift: where the tip is at the end against where it was early on, both after it came to rest.
std::string long_run(const StressCase& test, const StressSolver& solver, Judge& judge) {
    Made made = make(test.stress, solver);
    if (!made.run) return made.not_applicable.empty() ? made.refused : made.not_applicable;
    Trial trial(test.stress, std::move(made.run));
    // The reference is the equilibrium, so the frames are counted from it.
    Criteria calm;
    calm.rest = 1;
    settle(trial, judge, calm);
    judge.begin(trial);
    const std::size_t first = trial.steps;
    Double3 early{};
    double tip = 0;
    while (trial.steps - first < test.stress.frames.value_or(1000)) {
        if (auto done = trial.advance(); !done) {
            judge.demand("step taken: " + to_string(done.error()), false);
            return {};
        }
        judge.look(trial);
        if (trial.steps - first == test.criteria.drift_from) early = trial.run->points(0).back();
        tip = length(subtract(trial.run->points(0).back(), early));
    }
    judge.conclude(trial);
    judge.conclude_rest(trial);
    judge.check("tip moved since frame " + std::to_string(test.criteria.drift_from) + " / L", tip / test.stress.length,
                *test.criteria.drift);
    return {};
}

// Two runs that must tell the same story, one of them far away or in other units.
std::string two_runs(const StressCase& test, const StressSolver& solver, Judge& judge) {
    Stress other = test.stress;
    double unit = 1;
    if (test.stress.procedure == Procedure::other_units) {
        // centimetres and grams: lengths x 100, mass x 1000; a force g cm/s^2 = 1e-5 N
        unit = 100;
        other.length *= 100, other.radius *= 100, other.gravity *= 100;
        other.density *= 1e-3;
        other.youngs_modulus *= 10;
        for (StressStrand& strand : other.strands)
            for (std::vector<Double3>* points : {&strand.points, &strand.rest_points})
                for (Double3& p : *points) p = scaled(100, p);
    }
    Stress here = test.stress;
    here.offset = {};
    Made a = make(here, solver), b = make(other, solver);
    if (!a.run || !b.run)
        return a.run ? b.not_applicable + b.refused : a.not_applicable + a.refused;
    Trial first(here, std::move(a.run)), second(other, std::move(b.run));
    judge.begin(second);
    double apart = 0;
    while (!second.over()) {
        if (!first.advance() || !second.advance()) {
            judge.demand("step taken", false);
            return {};
        }
        if (unit == 1) judge.look(second);
        for (std::size_t s = 0; s < other.strands.size(); ++s) {
            const std::vector<Double3> x = first.run->points(s), y = second.run->points(s);
            for (std::size_t i = 0; i < x.size(); ++i)
                apart = std::max(apart, length(subtract(x[i], scaled(1 / unit, subtract(y[i], other.offset)))));
        }
    }
    judge.conclude(second);
    const double scale = unit == 1 ? 1 : test.stress.length;
    judge.check(unit == 1 ? "apart from the run at the origin (m)" : "apart in other units / L", apart / scale,
                test.criteria.trajectory.value_or(0) * solver.rounding);
    return {};
}

std::string repeated(const StressCase& test, const StressSolver& solver, Judge& judge) {
    std::vector<Trial> trials;
    for (const int threads : test.stress.threads)
        for (int k = 0; k < 2; ++k) {
            Made made = make(test.stress, solver, threads);
            if (!made.run) return made.not_applicable + made.refused;
            trials.emplace_back(test.stress, std::move(made.run));
        }
    bool same = true;
    while (!trials[0].over()) {
        for (Trial& t : trials)
            if (!t.advance()) same = false;
        for (Trial& t : trials) same &= all_same_bits(*trials[0].run, *t.run, test.stress.strands.size());
    }
    judge.demand("bitwise the same for all runs and threads", same);
    return {};
}

std::string resumed(const StressCase& test, const StressSolver& solver, Judge& judge) {
    Made a = make(test.stress, solver), b = make(test.stress, solver);
    if (!a.run || !b.run) return a.not_applicable + a.refused;
    Trial whole(test.stress, std::move(a.run)), later(test.stress, std::move(b.run));
    while (!whole.over() || whole.steps <= test.stress.resume_at) {
        if (!whole.advance()) break;
        if (whole.steps == test.stress.resume_at) {
            judge.demand("state taken back", bool(later.run->load(whole.run->save())));
            later.time = whole.time;
            later.steps = whole.steps;
        } else if (whole.steps > test.stress.resume_at && !later.advance()) {
            break;
        }
    }
    judge.demand("bitwise the same as the uninterrupted run",
                 whole.steps == later.steps && all_same_bits(*whole.run, *later.run, test.stress.strands.size()));
    return {};
}

// As input: refused. As a fault of memory on the way: counted, and the others as without that strand.
std::string spoiled(const StressCase& test, const StressSolver& solver, Judge& judge) {
    const std::size_t bad = test.stress.spoiled_strand, vertex = test.stress.spoiled_vertex;
    Stress wrong = test.stress;
    wrong.strands.at(bad).points.at(vertex)[1] = std::nan("");
    const Made refused = make(wrong, solver);
    judge.demand("refused: " + (refused.refused.empty() ? std::string("no") : refused.refused),
                 !refused.run && !refused.refused.empty());

    Stress without = test.stress;
    without.strands.erase(without.strands.begin() + static_cast<std::ptrdiff_t>(bad));
    Made a = make(test.stress, solver), b = make(without, solver);
    if (!a.run || !b.run) return a.not_applicable + a.refused;
    Trial ill(test.stress, std::move(a.run)), well(without, std::move(b.run));
    bool same = true;
    while (!ill.over()) {
        if (ill.steps == 10) ill.run->spoil(bad, vertex);
        if (!ill.advance() || !well.advance()) {
            judge.demand("step taken", false);
            return {};
        }
        for (std::size_t s = 0; s < without.strands.size(); ++s)
            same &= same_bits(*ill.run, *well.run, s < bad ? s : s + 1, s);
    }
    judge.demand("the strand with a NaN on the way is reported", ill.run->given_up() == 1);
    judge.demand("others bitwise as without it", same);
    return {};
}

std::string bad_inputs(const StressCase& test, const StressSolver& solver, Judge& judge) {
    for (const BadInput what : test.stress.bad_inputs) {
        Stress wrong = test.stress;
        Result<void> done;
        std::string said;
        switch (what) {
            case BadInput::negative_radius: wrong.radius = -wrong.radius; break;
            case BadInput::no_vertices: wrong.strands[0].points.clear(), wrong.strands[0].rest_points.clear(); break;
            case BadInput::one_vertex: wrong.strands[0].points.resize(1), wrong.strands[0].rest_points.resize(1); break;
            default: break;
        }
        Made made = make(wrong, solver);
        said = made.refused + made.not_applicable;
        bool refused = !made.run, unchanged = true;
        if (made.run) {
            Trial trial(wrong, std::move(made.run));
            if (auto first = trial.advance(); !first) return to_string(first.error());
            StressStep step{wrong.step, trial.root(), {}, {}};
            if (what == BadInput::zero_step) step.h = 0;
            if (what == BadInput::negative_step) step.h = -wrong.step;
            if (what == BadInput::zero_quaternion) step.root.rotation = {0, 0, 0, 0};
            const std::vector<Double3> before = trial.run->points(0);
            const bool acts = what == BadInput::zero_step || what == BadInput::negative_step ||
                              what == BadInput::zero_quaternion;
            if (acts) done = trial.run->step(step);
            unchanged = trial.run->points(0) == before;
            refused = acts && !done;
            if (refused) said = to_string(done.error());
            // a step of no time may be no step
            if (what == BadInput::zero_step && done) refused = unchanged, said = "nothing happened";
        }
        judge.demand(std::string(name_of(what)) + ": " + (refused ? said : "not refused"), refused && unchanged);
    }
    return {};
}

std::string run_procedure(const StressCase& test, const StressSolver& solver, Judge& judge) {
    switch (test.stress.procedure) {
        case Procedure::far:
        case Procedure::other_units: return two_runs(test, solver, judge);
        case Procedure::twice: return repeated(test, solver, judge);
        case Procedure::resume: return resumed(test, solver, judge);
        case Procedure::spoil: return spoiled(test, solver, judge);
        case Procedure::bad_input: return bad_inputs(test, solver, judge);
        case Procedure::run: break;
    }
    return test.criteria.drift ? long_run(test, solver, judge) : plain_run(test, solver, judge);
}

}  // namespace

const StressSolver* find_stress_solver(const std::string& name) {
    for (const StressSolver* solver : {&strand_stress_solver(), &rod_stress_solver()})
        if (name == solver->name) return solver;
    return nullptr;
}

Outcome run_stress(const StressCase& test, const StressSolver& solver) {
    Outcome out;
    out.id = test.id;
    out.family = "robustness";
    const auto start = std::chrono::steady_clock::now();
    Judge judge(test, solver);
    out.not_applicable = !test.unknown.empty() ? "this program does not know the change \"" + test.unknown + "\""
                                               : run_procedure(test, solver, judge);
    if (out.not_applicable.empty()) out.checks = std::move(judge.checks);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace keratin::report
