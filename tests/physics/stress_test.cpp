#include "tests/data_dir.h"
#include "tools/keratin-report/print.h"
#include "tools/keratin-report/stability.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <string>

using namespace keratin;
using namespace keratin::report;

namespace {

Json document(const char* change, const char* criteria) {
    Json d = Json::parse(R"({"schema": "hair-validation-1", "robustness": {"baseline": {
        "radius_m": 5e-5, "E_Pa": 3e9, "poisson": 0.35, "density": 1300, "length_m": 0.1, "vertices": 11,
        "gravity": 9.81, "dt": 0.01, "mass_damping_1_s": 1, "duration_s": 0.1}, "cases": []}})");
    d["robustness"]["cases"].push_back(
        {{"id", "x"}, {"change", Json::parse(change)}, {"criteria", Json::parse(criteria)}});
    return d;
}

StressCase read(const char* change, const char* criteria = "{}") {
    auto cases = read_stress(document(change, criteria), "cases.json");
    REQUIRE(cases);
    return cases->at(0);
}

// A strand that is nothing but its points: they fall, root and all.
class Falling final : public StressRun {
  public:
    explicit Falling(const Stress& stress) : points_(stress.strands[0].points) {}
    Result<void> step(const StressStep& step) override {
        speed_ -= 9.81 * step.h;
        for (Double3& p : points_) p[1] += speed_ * step.h;
        points_.back()[0] += 0.001;
        return {};
    }
    std::vector<Double3> points(std::size_t) const override { return points_; }
    std::vector<Double3> velocities(std::size_t) const override { return {points_.size(), {0, speed_, 0}}; }
    std::vector<double> masses(std::size_t) const override { return std::vector<double>(points_.size(), 1e-6); }
    double root_error(std::size_t, const RigidTransform&) const override { return std::fabs(points_[0][1]); }
    StressEnergy energy() const override { return {1, 0, 0}; }
    std::uint64_t given_up() const override { return 1; }
    void spoil(std::size_t, std::size_t) override {}
    std::vector<std::byte> save() const override { return {}; }
    Result<void> load(std::span<const std::byte>) override { return {}; }

  private:
    std::vector<Double3> points_;
    double speed_ = 0;
};

const StressSolver kFalling{"falling", 1e-9, 1, 0, 1,
                            [](const Stress& s, int) -> Result<std::unique_ptr<StressRun>> {
                                return std::unique_ptr<StressRun>(new Falling(s));
                            }};

}  // namespace

TEST_CASE("a case's numbers are taken from its words, whatever they are") {
    CHECK(read(R"({"E_scale": 0.5})").stress.youngs_modulus == Approx(1.5e9));
    const StressCase shake = read(R"({"root_motion": "sin, amplitude 0.02 m, 7 Hz"})");
    CHECK(root_at(shake.stress.root, 1 / 28.0).translation[1] == Approx(0.02));
    const StressCase jitter = read(R"({"dt": "log-uniform random in [0.0005, 0.02] s, seed 3"})");
    CHECK(jitter.stress.shortest == 0.0005);
    CHECK(jitter.stress.longest == 0.02);
    CHECK(jitter.stress.seed == 3);
    const StressCase fold = read(R"({"initial": "vertex 4: the outgoing edge exactly anti-parallel to the incoming edge"})");
    CHECK(fold.stress.strands[0].points[5][0] == Approx(0.03));
    CHECK(fold.stress.strands[0].rest_points[5][0] == Approx(0.05));
    const StressCase ball = read(R"({"initial": "the middle third of the strand inside a sphere of radius 3 cm"})",
                                 R"({"penetration": "<= 2 radius within 0.25 s"})");
    CHECK(ball.stress.solids.at(0).radius == Approx(0.03));
    CHECK(*ball.criteria.penetration == 2);
    CHECK(ball.criteria.penetration_from == 0.25);
    const StressCase close = read(R"({"strands": 2, "initial": "parallel, distance 1.5 r, offset of 0.01 m along the axis"})");
    CHECK(close.stress.strands.at(1).points[0][0] == Approx(0.01));
    CHECK(close.stress.strands.at(1).points[0][2] == Approx(7.5e-5));
    const StressCase rapid = read(R"({"root_acceleration_m_s2": 100, "duration_s": 0.2, "direction": "x", "then": "stop"})");
    CHECK(root_at(rapid.stress.root, 5).translation[0] == Approx(2));
    CHECK(rapid.stress.duration == 0.1);
}

TEST_CASE("a change that is not known is said and not passed") {
    const StressCase test = read(R"({"hair_colour": "red"})", R"({"finite": true})");
    const Outcome outcome = run_stress(test, strand_stress_solver());
    CHECK(outcome.not_applicable.find("hair_colour") != std::string::npos);
    CHECK_FALSE(outcome.passed());
}

TEST_CASE("what breaks a robustness criterion is measured and fails") {
    const StressCase test = read("{}", R"({"finite": true, "root": true, "stretch": 0.05, "speed": 0.5,
                                           "bounded_energy": true, "rest": 0.02, "reject": false})");
    const Outcome outcome = run_stress(test, kFalling);
    REQUIRE(outcome.checks.size() == 8);
    for (const Check& c : outcome.checks) {
        // its energy says that it never changes
        INFO(c.what << " " << c.measured);
        CHECK(c.passed() == (c.what.find("energy") != std::string::npos));
    }
    CHECK(outcome.checks[2].measured == Approx(1).margin(0.01));  // 1 mm a step, 10 steps, on 1 cm
}

TEST_CASE("the strand solver keeps a case of the file's own kind") {
    const Outcome outcome = run_stress(read(R"({"E_scale": 2})", R"({"finite": true, "root": true, "stretch": 0.02,
                                            "bounded_energy": true, "rest": 0.02})"), strand_stress_solver());
    for (const Check& c : outcome.checks) {
        INFO(c.what << " " << c.measured << " of " << c.tolerance);
        CHECK(c.passed());
    }
}

TEST_CASE("strands of any stiffness come out of a fold and come to rest") {
    for (const char* stiffness : {"0.01", "1", "100"})
        for (const char* vertex : {"4", "24"}) {
            const std::string change =
                std::string(R"({"initial": "vertex )") + vertex +
                R"(: the outgoing edge exactly anti-parallel to the incoming edge",
                                       "rest": "straight", "vertices": 32, "length_m": 0.15, "duration_s": 2, "dt": 0.008333333,
                                       "E_scale": )" +
                stiffness + "}";
            const Outcome outcome = run_stress(
                read(change.c_str(), R"({"finite": true, "root": true, "speed": 500, "rest": 0.05,
                     "bounded_energy": "E_el(0) may be clamped/infinite: require E <= max(E after first step) afterwards"})"),
                strand_stress_solver());
            INFO("stiffness " << stiffness << ", vertex " << vertex << "\n"
                              << outcome_text(outcome));
            CHECK(outcome.passed());
        }
}

TEST_CASE("a strand that is shaken takes up no more than the root puts in") {
    for (const char* motion : {"sin, amplitude 0.01 m, 12 Hz", "sin, amplitude 0.05 m, 3 Hz",
                               "sin, amplitude 0.1 m, 3 Hz"})
        for (const char* step : {"0.0333333", "0.00416667"}) {
            const std::string change =
                std::string(R"({"root_motion": ")") + motion +
                R"(", "vertices": 32, "length_m": 0.15, "duration_s": 2, "dt": )" + step + "}";
            const Outcome outcome = run_stress(
                read(change.c_str(),
                     R"({"finite": true, "root": true, "stretch": 0.02, "bounded_energy": true})"),
                strand_stress_solver());
            INFO(motion << " at steps of " << step << " s\n" << outcome_text(outcome));
            CHECK(outcome.passed());
        }
}

TEST_CASE("the strand solver stands every hard treatment that it can express") {
    std::ifstream file(KERATIN_DATA_DIR "/validation/public.json");
    auto cases = read_stress(Json::parse(file), "public.json");
    REQUIRE(cases);
    std::size_t judged = 0;
    for (const StressCase& test : *cases) {
        // a thousand seconds long
        if (test.criteria.drift) continue;
        // how dear steps are depends on what else the machine does
        StressCase untimed = test;
        untimed.criteria.time.reset();
        const Outcome out = run_stress(untimed, strand_stress_solver());
        INFO(outcome_text(out));
        if (!out.not_applicable.empty()) continue;
        ++judged;
        CHECK(out.passed());
    }
    CHECK(judged == 42);
}
