// Strand on strand: what an impact must keep, and the measure of the contact law itself.
#include "runtime/contact/coulomb.h"
#include "runtime/contact/strand_contact.h"
#include "tools/keratin-report/case.h"

#include <algorithm>

namespace keratin::report {

namespace {

// Passes everything on and keeps the impulse of the step's last pass.
class Witness final : public ContactSolver {
  public:
    explicit Witness(StrandContact& contact) : contact_(contact) {}
    void begin_step(const ContactProblem& problem) override { contact_.begin_step(problem); }
    std::size_t detect(const ContactProblem& problem, std::span<const double> v) override {
        return contact_.detect(problem, v);
    }
    ContactPass pass(const ContactProblem& problem, std::span<const double> v, const RodInverse& inverse,
                     std::span<double> impulse) override {
        const ContactPass out = contact_.pass(problem, v, inverse, impulse);
        impulse_.assign(impulse.begin(), impulse.end());
        return out;
    }
    void end_step(const ContactProblem& problem, std::span<const double> v) override {
        contact_.end_step(problem, v);
        linear_ = angular_ = {0, 0, 0};
        const RodLayout& layout = problem.layout;
        for (std::size_t s = 0; s < layout.first.size(); ++s)
            for (std::uint32_t i = 0; i < layout.vertex_count[s]; ++i) {
                Vector3 x, p, next;
                double* to[] = {&x.x, &x.y, &x.z};
                double* of[] = {&p.x, &p.y, &p.z};
                double* after[] = {&next.x, &next.y, &next.z};
                const bool edge = i + 1 < layout.vertex_count[s];
                for (std::size_t c = 0; c < 3; ++c) {
                    *to[c] = problem.x_t0[layout.index(s, i, c)] + problem.origin[c];
                    *of[c] = impulse_[layout.index(s, i, c)];
                    *after[c] = edge ? problem.x_t0[layout.index(s, i + 1, c)] + problem.origin[c] : 0;
                }
                linear_ += p;
                angular_ += cross(x, p);
                if (!edge) continue;
                const Vector3 e = next - x;
                angular_ += (impulse_[layout.index(s, i, 3)] / length(e)) * e;
            }
    }
    // Of the last step's impulses on all strands: sum of I, and of x_t x I and spins.
    const Vector3& linear() const { return linear_; }
    const Vector3& angular() const { return angular_; }

  private:
    StrandContact& contact_;
    std::vector<double> impulse_;
    Vector3 linear_{0, 0, 0}, angular_{0, 0, 0};
};

double energy(const RodSimulation& rods) {
    double sum = 0;
    for (std::size_t s = 0; s < rods.strand_count(); ++s) {
        const RodEnergy e = rods.energy(s);
        sum += e.kinetic + e.elastic() + e.potential;
    }
    return sum;
}

Double3 momentum(const RodSimulation& rods, std::size_t s) {
    Double3 sum{0, 0, 0};
    for (std::size_t i = 0; i < rods.vertex_count(s); ++i)
        for (std::size_t c = 0; c < 3; ++c) sum[c] += rods.vertex_mass(s, i) * rods.velocity(s, i)[c];
    return sum;
}

// Two crossing rods, the second at rest, the first coming down on it: contact where each is a1 and a2
// from its middle.
RodSimulation crossing_rods(const Json& setup, const Json& rods, double stiffening, double step,
                            std::size_t edges) {
    const double l1 = rods.at("L1").get<double>(), l2 = rods.at("L2").get<double>();
    const double a1 = rods.at("a1").get<double>(), a2 = rods.at("a2").get<double>(), v = rods.at("v").get<double>();
    RodMaterial material = material_of(setup);
    material.youngs_modulus *= stiffening;
    RodStrand first = straight_strand(edges, l1, {1, 0, 0}), second = straight_strand(edges, l2, {0, 0, 1});
    const double above = 2 * material.radii[0] + 2.5 * v * step;
    for (Double3& p : first.points) p = {p[0] - l1 / 2 - a1, above, 0};
    for (Double3& p : second.points) p = {0, 0, p[2] - l2 / 2 - a2};
    first.velocities.assign(edges + 1, {0, -v, 0});
    for (RodStrand* s : {&first, &second}) {
        s->material = material;
        s->root = RodEnd::free;
    }
    RodSettings settings;
    settings.gravity = {0, -setup.value("gravity", 0.0), 0};
    settings.threads = 1;
    return make_rods({first, second}, settings);
}

}  // namespace

std::vector<Check> run_free_rod_contact(const Json& test) {
    const Json& setup = test.at("setup");
    const Json& tolerance = test.at("tolerance");
    const Json& limits = test.at("reference").at("rigid_limit");
    constexpr std::size_t kEdges = 20;
    // s: 50 steps of 0.1 ms see the impact and the ringing after it
    constexpr double kStep = 1e-4;
    constexpr int kSteps = 50;
    std::vector<Check> checks;
    for (std::size_t k = 0; k < setup.at("cases").size(); ++k) {
        const Json& rods_at = setup.at("cases").at(k);
        const Json& rigid = limits.at(k);
        for (const double mu : {0.0, 0.3}) {
            ContactSettings contact_settings;
            contact_settings.friction = mu;
            contact_settings.threads = 1;
            const std::string which = ", pair " + std::to_string(k + 1) + (mu > 0 ? ", mu 0.3" : ", mu 0");
            for (const double stiffening : {1.0, 1e3}) {
                RodSimulation rods = crossing_rods(setup, rods_at, stiffening, kStep, kEdges);
                StrandContact contact(contact_settings, {});
                Witness witness(contact);
                rods.attach_contact(&witness);
                const auto total = [&] {
                    const Double3 a = momentum(rods, 0), b = momentum(rods, 1);
                    return Double3{a[0] + b[0], a[1] + b[1], a[2] + b[2]};
                };
                const Double3 p0 = total();
                const double p = std::hypot(p0[0], p0[1], p0[2]);
                // the case's |L(0)| depends on where one stands and may be 0: |P(0)| at half a rod
                const double l = p * rods_at.at("L1").get<double>() / 2;
                const double e0 = energy(rods);
                double drift = 0, turn = 0, rise = 0, before = e0;
                bool met = false;
                for (int n = 0; n < kSteps; ++n) {
                    (void)rods.step(kStep);
                    drift = std::max(drift, distance(total(), p0) / p);
                    turn = std::max(turn, length(witness.angular()) / l);
                    const double now = energy(rods);
                    rise = std::max(rise, (now - before) / e0);
                    before = now;
                    met = met || contact.report().active > 0;
                }
                const auto speed = [&](std::size_t s) {
                    double mass = 0;
                    for (std::size_t i = 0; i <= kEdges; ++i) mass += rods.vertex_mass(s, i);
                    return -momentum(rods, s)[1] / mass;
                };
                const double fail = met ? 0 : std::nan("");  // they never met: nothing was tested
                if (stiffening == 1.0) {
                    checks.push_back({"momentum lost, share" + which, drift, 0, drift + fail,
                                      tolerance.at("linear_momentum_rel").get<double>()});
                    checks.push_back({"turn of a step's impulses, share" + which, turn, 0, turn + fail,
                                      tolerance.at("impulse_angular_momentum_rel").get<double>()});
                    checks.push_back({"energy gained in a step, share" + which, std::max(0.0, rise), 0,
                                      std::max(0.0, rise) + fail, tolerance.at("energy_increase_rel").get<double>()});
                } else {
                    const double r1 = rigid.at("v1_after").get<double>(), r2 = rigid.at("v2_after").get<double>();
                    const double bound = tolerance.at("rigid_velocity_rel").get<double>();
                    checks.push_back({"speed after (m/s), first rod" + which, speed(0), r1, relative(speed(0), r1) + fail, bound});
                    checks.push_back({"speed after (m/s), second rod" + which, speed(1), r2, relative(speed(1), r2) + fail, bound});
                }
            }
        }
    }
    return checks;
}

std::vector<Check> run_coulomb_residual(const Json& test) {
    const double tolerance = test.at("tolerance").at("abs").get<double>();
    std::vector<Check> checks;
    for (const Json& v : test.at("reference").at("vectors")) {
        const Double3 r = vector3(v.at("r")), u = vector3(v.at("u"));
        const double found = coulomb_residual(Local3<Double1>{r[0], r[1], r[2]}, Local3<Double1>{u[0], u[1], u[2]},
                                              Double1(v.at("mu").get<double>()))
                                 .v;
        const double reference = v.at("residual").get<double>();
        checks.push_back({v.at("name").get<std::string>(), found, reference, std::abs(found - reference), tolerance});
    }
    return checks;
}

}  // namespace keratin::report
