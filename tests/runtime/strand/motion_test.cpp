#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>

#include <random>

using namespace keratin;
using namespace keratin::test;

namespace {

struct Shake {
    double stretch = 0, lag = 0, depth = 0;
    std::vector<Point> tips;  // of one guide, once a 30th of a second
    std::uint64_t hash = 0;
};

// Two seconds of the demo's motion on a head of 9.8 cm inside of the roots' sphere.
Shake shake(const Settings& settings, double rate, scenes::GroomOptions options,
            std::uint32_t points = 16, double length = 0.25) {
    options.colliders = {{{0, 0, 0}, {0, 0, 0}, 0.098f, 0}};
    const scenes::Groom groom = head(192, points, length, options);
    Simulation s = made(groom, settings);
    Shake out;
    const int steps = int(std::lround(2 * rate)), every = int(std::lround(rate / 30));
    for (int i = 1; i <= steps; ++i) {
        const RigidTransform motion = shaken(i / rate);
        must(s.set_motion(motion));
        must(s.step(1 / rate));
        out.stretch = std::max(out.stretch, stretch(s));
        for (std::uint32_t lane : lanes_of(s)) {
            const std::uint32_t last = points_of(s, lane) - 1;
            out.lag = std::max(out.lag,
                               distance(tip(s, lane), carried(motion, rest_point(s, lane, last))));
            for (std::uint32_t p = 2; p <= last; ++p)
                out.depth = std::max(
                    out.depth, 0.098 - distance(point(s, lane, p), {motion.translation[0], 0, 0}));
        }
        if (i % every == 0) out.tips.push_back(tip(s, 7));
    }
    out.hash = s.position_hash();
    return out;
}

}  // namespace

TEST_CASE("shaken hair keeps its length, lags its root and stays out of the head") {
    const double rate = GENERATE(30.0, 60.0, 120.0, 240.0);
    scenes::GroomOptions options;
    options.group.strand.damping = {0.05f};
    const Shake s = shake(single_thread(), rate, options);
    INFO("stretch " << s.stretch << ", lag " << s.lag << " m, depth " << s.depth << " m");
    CHECK(s.stretch < 0.001);
    CHECK(s.lag > 0.02);
    CHECK(s.depth < 0.001);
}

TEST_CASE("32 points keep their length as well as 16") {
    const double rate = GENERATE(30.0, 60.0, 120.0, 240.0);
    const Shake s = shake(single_thread(), rate, {}, 32, 0.3);
    INFO(rate << " Hz: stretch " << s.stretch << ", depth " << s.depth << " m");
    CHECK(s.stretch < 0.001);
    CHECK(s.depth < 0.001);
}

TEST_CASE("the result does not depend on threads or instruction set") {
    scenes::GroomOptions options;
    options.group.strand.friction = {0.1f, 0.2f};
    options.group.strand.volume = {0.3f};
    options.guide_every = 2;
    Settings settings = single_thread();
    settings.wind = {{1, 0, 0.5f}, 0.5f, 0.5f};
    settings.instruction_set = InstructionSet::baseline;
    const std::uint64_t expected = shake(settings, 30, options).hash;
    settings.threads = 2;
    CHECK(shake(settings, 30, options).hash == expected);
    settings.threads = 5;
    CHECK(shake(settings, 30, options).hash == expected);
    for (InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
        if (usable_instruction_set(set) != set) continue;
        settings.instruction_set = set;
        CHECK(shake(settings, 30, options).hash == expected);
    }
}

TEST_CASE("render strands of any length and volume alone are the same on all instruction sets") {
    const std::uint32_t points = GENERATE(5u, 16u, 21u);
    scenes::GroomOptions options;
    options.guide_every = 3;
    options.group.strand.volume = {0.2f};
    Settings settings = single_thread();
    settings.output = GENERATE(OutputPrecision::float32, OutputPrecision::float16);
    settings.instruction_set = InstructionSet::baseline;
    const std::uint64_t expected = shake(settings, 30, options, points).hash;
    for (InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
        if (usable_instruction_set(set) != set) continue;
        settings.instruction_set = set;
        INFO(points << " points, set " << int(set));
        CHECK(shake(settings, 30, options, points).hash == expected);
    }
}

TEST_CASE("the path of a tip hardly depends on the frame rate") {
    scenes::GroomOptions options;
    options.group.strand.damping = {0.1f};
    options.group.strand.friction = {0.05f};
    const double length = 0.25;
    const Shake reference = shake(single_thread(), 240, options, 16, length);
    for (double rate : {30.0, 60.0, 120.0}) {
        const Shake s = shake(single_thread(), rate, options, 16, length);
        double worst = 0;
        for (std::size_t i = 0; i < s.tips.size(); ++i)
            worst = std::max(worst, distance(s.tips[i], reference.tips[i]));
        INFO(rate << " Hz: " << worst / length << " of the length");
        CHECK(worst < 0.05 * length);
    }
}

TEST_CASE("random steps follow the same path as even ones") {
    scenes::GroomOptions options;
    options.group.strand.damping = {0.1f};
    const scenes::Groom groom = head(64, 16, 0.25, options);
    Simulation even = made(groom, single_thread()), random = made(groom, single_thread());
    std::mt19937 engine(7);
    std::uniform_real_distribution<double> part(0.1, 1.0);
    double time = 0;
    while (time < 2) {
        // Cuts 1/30 s into random parts.
        double left = 1.0 / 30;
        while (left > 1e-9) {
            double h = std::min(left, part(engine) / 60);
            if (left - h < 1e-3) h = left;
            must(random.set_motion(shaken(time + 1.0 / 30 - left + h)));
            must(random.step(h));
            left -= h;
        }
        for (int i = 1; i <= 2; ++i) {
            must(even.set_motion(shaken(time + i / 60.0)));
            must(even.step(1.0 / 60));
        }
        time += 1.0 / 30;
        for (std::uint32_t lane : {3u, 20u, 50u})
            REQUIRE(distance(tip(even, lane), tip(random, lane)) < 0.05 * 0.25);
    }
}

TEST_CASE("a free point falls exactly, whatever the steps") {
    // A strand without stiffness or lengths to keep: the middle of a cut strand is in free flight.
    scenes::GroomOptions options;
    options.group.strand.damping = {0.0f};
    Settings settings = single_thread();
    settings.passes.stretch = settings.passes.global_length = settings.passes.local_shape = false;
    const scenes::Line line = scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.2, 8);
    const scenes::Groom groom = scenes::make_groom({&line, 1}, options);
    Simulation s = made(groom, settings);
    double time = 0;
    for (double h : {0.01, 0.02, 0.005, 0.03, 0.0171, 0.002}) {
        must(s.step(h));
        time += h;
    }
    const double fallen = -point(s, 0, 5)[1];
    CHECK(fallen == Approx(0.5 * 9.81 * time * time).epsilon(1e-4));
}
