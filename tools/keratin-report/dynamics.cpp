// Families that compare a motion with its reference.
#include "tools/keratin-report/case.h"

#include <algorithm>
#include <functional>

namespace keratin::report {

namespace {

constexpr double kPi = 3.14159265358979323846;

// The first bending shape of a clamped beam at s = 0..1, normed to 1 at the tip.
double first_mode(double s) {
    const double b = 1.8751040687119612;
    const double q = (std::cosh(b) + std::cos(b)) / (std::sinh(b) + std::sin(b));
    return (std::cosh(b * s) - std::cos(b * s) - q * (std::sinh(b * s) - std::sin(b * s))) / 2;
}

// Times of the first zeros of a sampled signal, linear between samples; NaN for those that do not come.
std::vector<double> zero_times(const std::function<double()>& signal, const std::function<void()>& step, double h,
                               std::size_t count, int most) {
    std::vector<double> times;
    double last = signal();
    for (int n = 0; n < most && times.size() < count; ++n) {
        step();
        const double now = signal();
        if (last != 0 && (last > 0) != (now > 0)) times.push_back(h * (n + last / (last - now)));
        last = now;
    }
    times.resize(count, std::nan(""));
    return times;
}

}  // namespace

std::vector<Check> run_vibration(const Json& test) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>(), f1 = test.at("reference").at("f1_Hz").get<double>();
    std::vector<Check> checks;
    for (const auto& [edges, tolerance] : resolutions(test.at("tolerance"))) {
        RodStrand strand = straight_strand(edges, length, {1, 0, 0});
        strand.material = material_of(setup);
        RodSettings settings = settings_of(setup);
        settings.tolerance = 1e-12;
        RodSimulation rods = make_rods({strand}, settings);
        // the shape under a force on the tip that bends it by 1 % of the length
        const double r = strand.material.radii[0];
        const double stiffness = strand.material.youngs_modulus * kPi * r * r * r * r / 4;
        (void)rods.set_force(0, edges, {0, 3 * stiffness * 0.01 * length / (length * length * length), 0});
        rods.settle({.tolerance = 1e-12 * length});
        (void)rods.set_force(0, edges, {0, 0, 0});
        const double h = 2e-4 / f1;
        // the part of the motion that is the first mode, so that higher ones do not shift its zeros
        const auto amplitude = [&] {
            double sum = 0;
            for (std::size_t i = 1; i <= edges; ++i)
                sum += rods.vertex_mass(0, i) * rods.position(0, i)[1] *
                       first_mode(static_cast<double>(i) / static_cast<double>(edges));
            return sum;
        };
        const std::vector<double> zeros =
            zero_times(amplitude, [&] { (void)rods.step(h); }, h, 3, static_cast<int>(2 / (f1 * h)));
        const double found = 1 / (zeros[2] - zeros[0]);
        checks.push_back({at("f1 (Hz)", edges), found, f1, relative(found, f1), tolerance});
    }
    return checks;
}

std::vector<Check> run_pendulum(const Json& test) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>(), angle = setup.at("theta0_deg").get<double>() * kPi / 180;
    std::vector<Check> checks;
    for (const auto& [key, value] : test.at("reference").items()) {
        if (key.rfind("N", 0) != 0 || key.find("_period_s") == std::string::npos || key.rfind("Ninf", 0) == 0) continue;
        const auto edges = static_cast<std::size_t>(std::stoul(key.substr(1)));
        const double period = value.get<double>();
        for (const auto& [rate, tolerance] : test.at("tolerance").items()) {
            if (rate.rfind("dt_", 0) != 0) continue;
            std::string text = rate.substr(3);
            std::replace(text.begin(), text.end(), '_', '-');
            const double h = std::stod(text);
            if (h < 5e-4 && edges > 20) continue;  // long, and nothing that fewer edges do not show
            RodStrand strand = straight_strand(edges, length, {std::sin(angle), -std::cos(angle), 0});
            strand.material = material_of(setup);
            strand.root = RodEnd::pinned;
            RodSettings settings = settings_of(setup);
            settings.bend_scale = 1e4;  // straight, as the case asks
            // implicit Euler takes the swing down and with it the period, by 1.5 to 4 % at 1 ms from a
            // right angle on: more than is allowed, at any mesh
            settings.integrator = RodIntegrator::midpoint;
            RodSimulation rods = make_rods({strand}, settings);
            // the tip turns back for the second time: a whole period after the release
            const auto speed = [&] {
                const Double3 p = rods.position(0, edges), v = rods.velocity(0, edges);
                return p[0] * v[1] - p[1] * v[0];
            };
            const auto step = [&] { (void)rods.step(h); };
            step();
            const double found = h + zero_times(speed, step, h, 2, static_cast<int>(4 * period / h))[1];
            checks.push_back({at("period (s)", edges) + ", dt " + text + " s, midpoint", found, period, relative(found, period),
                              tolerance.get<double>()});
        }
    }
    return checks;
}

namespace {

// Tip and middle at the reference times, 4 numbers each, over the length.
std::vector<std::array<double, 4>> fall(const Json& test, std::size_t edges, double dt) {
    const Json& setup = test.at("setup");
    const double length = setup.at("length_m").get<double>();
    RodStrand strand = straight_strand(edges, length, {1, 0, 0});
    strand.material = material_of(setup);
    RodSimulation rods = make_rods({strand}, settings_of(setup));
    std::vector<std::array<double, 4>> out;
    double time = 0;
    for (const Json& t : test.at("reference").at("times_s")) {
        const double until = t.get<double>();
        const int steps = std::max(1, static_cast<int>(std::ceil((until - time) / dt - 1e-6)));
        for (int k = 0; k < steps; ++k) (void)rods.step((until - time) / steps);
        time = until;
        const Double3 tip = rods.position(0, edges), middle = rods.position(0, edges / 2);
        out.push_back({tip[0] / length, tip[1] / length, middle[0] / length, middle[1] / length});
    }
    return out;
}

double worst_distance(const std::vector<std::array<double, 4>>& found, const Json& reference) {
    double worst = 0;
    for (std::size_t k = 0; k < found.size(); ++k)
        for (std::size_t c = 0; c < 4; c += 2)
            worst = std::max(worst, std::hypot(found[k][c] - reference.at(k).at(c).get<double>(),
                                               found[k][c + 1] - reference.at(k).at(c + 1).get<double>()));
    return worst;
}

}  // namespace

std::vector<Check> run_falling_hair(const Json& test) {
    const Json& reference = test.at("reference").at("pos_over_L");
    std::vector<Check> checks;
    for (const auto& [key, value] : test.at("tolerance").items()) {
        const std::size_t mark = key.find("_dt_");
        if (key[0] != 'N' || mark == std::string::npos) continue;
        const auto edges = static_cast<std::size_t>(std::stoul(key.substr(1, mark - 1)));
        const std::string rate = key.substr(mark + 4);
        std::vector<std::array<double, 4>> found;
        if (rate == "to_0") {
            // the limit, from steps h, h/2, h/4: an error of a h + b h^2 is taken off
            const double h = 8e-5;
            const auto a = fall(test, edges, h), b = fall(test, edges, h / 2), c = fall(test, edges, h / 4);
            found = a;
            for (std::size_t k = 0; k < a.size(); ++k)
                for (std::size_t n = 0; n < 4; ++n) found[k][n] = (a[k][n] - 6 * b[k][n] + 8 * c[k][n]) / 3;
        } else {
            found = fall(test, edges, std::stod(rate));
        }
        const double error = worst_distance(found, reference);
        checks.push_back({at("tip and middle error / L", edges) + ", dt " + rate, error, 0, error, value.get<double>()});
    }
    return checks;
}

}  // namespace keratin::report
