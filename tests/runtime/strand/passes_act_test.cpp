// Every pass acts: switched off, a named measure moves by a stated amount.
#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>

using namespace keratin;
using namespace keratin::test;

namespace {

// Shakes a head for a second and calls measure(simulation) after every step.
template <class Measure>
void shake(const scenes::Groom& groom, const Settings& settings, Measure&& measure) {
    Simulation s = made(groom, settings);
    for (int i = 1; i <= 60; ++i) {
        must(s.set_motion(shaken(i / 60.0)));
        must(s.step(1.0 / 60));
        measure(s);
    }
}

// Mean speed at which points of neighbouring guides pass each other, over pairs near at rest.
double relative_speed(const Simulation& s) {
    double sum = 0, count = 0;
    const auto lanes = lanes_of(s);
    for (std::size_t a = 0; a < lanes.size(); ++a)
        for (std::size_t b = a + 1; b < lanes.size(); ++b) {
            if (distance(rest_point(s, lanes[a], 10), rest_point(s, lanes[b], 10)) > 0.1) continue;
            const auto velocity = [&](std::uint32_t lane) {
                const Point x = point(s, lane, 10), q = at(s, s.guides().previous, lane, 10);
                const double h = s.guides().previous_step;
                return Point{(x[0] - q[0]) / h, (x[1] - q[1]) / h, (x[2] - q[2]) / h};
            };
            sum += distance(velocity(lanes[a]), velocity(lanes[b]));
            ++count;
        }
    return sum / count;
}

// Share of points that stand in voxels of 2 cm with more than `many` points.
double crowded(const Simulation& s) {
    std::vector<std::array<int, 3>> cells;
    for (std::uint32_t lane : lanes_of(s))
        for (std::uint32_t p = 2; p < points_of(s, lane); ++p) {
            const Point x = point(s, lane, p);
            cells.push_back({int(std::floor(x[0] / 0.02)), int(std::floor(x[1] / 0.02)),
                             int(std::floor(x[2] / 0.02))});
        }
    std::sort(cells.begin(), cells.end());
    double sum = 0;
    for (std::size_t i = 0; i < cells.size();) {
        std::size_t j = i;
        while (j < cells.size() && cells[j] == cells[i]) ++j;
        sum += double(j - i) * double(j - i);
        i = j;
    }
    return sum / double(cells.size());  // mean number of points that a point shares its voxel with
}

}  // namespace

TEST_CASE("friction lowers the relative speed of neighbours by a third at least", "[acts]") {
    scenes::GroomOptions options;
    options.group.strand.friction = {0.4f};
    const scenes::Groom groom = head(128, 12, 0.25, options);
    const auto mean = [&](bool on) {
        Settings settings = single_thread();
        settings.passes.grid_friction = on;
        settings.grid_resolution = 8;  // voxels as wide as neighbours of so few guides are apart
        double sum = 0;
        shake(groom, settings, [&](const Simulation& s) { sum += relative_speed(s) / 60; });
        return sum;
    };
    const double with = mean(true), without = mean(false);
    INFO(with << " m/s with, " << without << " m/s without");
    CHECK(with < 0.67 * without);
}

TEST_CASE("volume preservation thins out crowded voxels by a tenth at least", "[acts]") {
    scenes::GroomOptions options;
    options.group.strand.volume = {2.0f};
    const scenes::Groom groom = head(256, 12, 0.25, options);
    const auto last = [&](bool on) {
        Settings settings = single_thread();
        settings.passes.grid_volume = on;
        double value = 0;
        shake(groom, settings, [&](const Simulation& s) { value = crowded(s); });
        return value;
    };
    const double with = last(true), without = last(false);
    INFO(with << " points a voxel with, " << without << " without");
    CHECK(with < 0.9 * without);
}

TEST_CASE("volume preservation leaves a groom that rests as it was groomed, however it is turned") {
    scenes::GroomOptions options;
    options.group.strand.volume = {1.0f};
    options.group.strand.damping = {0.1f};
    const scenes::Groom groom = head(256, 12, 0.25, options);
    Settings settings = single_thread();
    settings.gravity = {0, 0, 0};
    Simulation s = made(groom, settings);
    for (const double yaw : {0.0, 0.6}) {
        must(s.set_motion({{0.1 * yaw, 0, 0}, {0, std::sin(yaw / 2), 0, std::cos(yaw / 2)}}));
        s.reset();
        run(s, 2, 1.0 / 60);
        INFO(away_from_rest(s) << " m");
        CHECK(away_from_rest(s) < 1e-5);
    }
}

TEST_CASE("local shape keeps stiff hair twice as near to the groomed pose", "[acts]") {
    scenes::GroomOptions options;
    options.group.material.radius = options.group.material.radius2 = 1e-4f;
    const scenes::Groom groom = head(64, 12, 0.1, options);
    const auto mean = [&](bool on) {
        Settings settings = single_thread();
        settings.passes.local_shape = on;
        double sum = 0;
        shake(groom, settings, [&](const Simulation& s) { sum += away_from_rest(s) / 60; });
        return sum;
    };
    const double with = mean(true), without = mean(false);
    INFO(with << " m with, " << without << " m without");
    CHECK(with < 0.5 * without);
}

TEST_CASE("stretch and global length keep what free points lose", "[acts]") {
    const scenes::Groom groom = head(64, 12, 0.25);
    const auto worst = [&](bool tension, bool global) {
        Settings settings = single_thread();
        settings.passes.stretch = tension;
        settings.passes.global_length = global;
        double value = 0;
        shake(groom, settings, [&](const Simulation& s) { value = std::max(value, stretch(s)); });
        return value;
    };
    const double none = worst(false, false), tension = worst(true, false);
    const double both = worst(true, true);
    INFO("stretch " << none << " with neither, " << tension << " with tension, " << both
                    << " with both");
    CHECK(none > 0.2);
    CHECK(tension < 0.5 * none);
    CHECK(both < 1e-4);
}

TEST_CASE("tension carries the motion that pulling to the parent alone would lose", "[acts]") {
    // With the lengths kept by pulls alone the parents feel nothing of what hangs on them: the tips
    // move another way.
    const scenes::Groom groom = head(64, 12, 0.25);
    std::vector<Point> with, without;
    Settings settings = single_thread();
    shake(groom, settings, [&](const Simulation& s) { with.push_back(tip(s, 9)); });
    settings.passes.stretch = false;
    shake(groom, settings, [&](const Simulation& s) { without.push_back(tip(s, 9)); });
    double far = 0;
    for (std::size_t i = 0; i < with.size(); ++i)
        far = std::max(far, distance(with[i], without[i]));
    INFO(far << " m apart");
    CHECK(far > 0.02);
}

TEST_CASE("without collision hair falls through the head", "[acts]") {
    scenes::GroomOptions options;
    options.colliders = {{{0, 0, 0}, {0, 0, 0}, 0.098f, 0}};
    const scenes::Groom groom = head(64, 12, 0.25, options);
    const auto depth = [&](bool on) {
        Settings settings = single_thread();
        settings.passes.collision = on;
        double value = 0;
        double time = 0;
        shake(groom, settings, [&](const Simulation& s) {
            time += 1.0 / 60;
            const auto center = shaken(time).translation;
            for (std::uint32_t lane : lanes_of(s))
                for (std::uint32_t p = 2; p < points_of(s, lane); ++p)
                    value = std::max(value, 0.098 - distance(point(s, lane, p), {center[0], 0, 0}));
        });
        return value;
    };
    CHECK(depth(true) < 0.001);
    CHECK(depth(false) > 0.02);
}

TEST_CASE("without interpolation there are no render strands to read") {
    const scenes::Groom groom = head(256, 12, 0.2, {});
    Settings settings = single_thread();
    settings.passes.interpolation = false;
    Simulation s = made(groom, settings);
    REQUIRE(s.step(1.0 / 60));
    CHECK(s.strands().strand_count == 0);
    CHECK(s.strands().position.empty());
}

TEST_CASE("interpolation gives back the groom at rest, which its guides alone do not", "[acts]") {
    scenes::GroomOptions options;
    options.guide_every = 8;
    const scenes::Groom groom = head(256, 12, 0.2, options);
    Simulation s = made(groom, single_thread());
    const StrandView view = s.strands();
    double worst = 0, guides_only = 0;
    for (std::uint32_t i = 0; i < groom.info.strand_count; ++i) {
        const std::uint32_t lane = groom.strand_guide[i * 3];
        for (std::uint32_t p = 0; p < 12; ++p) {
            const std::size_t at = (groom.strand_first_point[i] + p) * 3;
            const Point rest{double(groom.strand_position[at]),
                             double(groom.strand_position[at + 1]),
                             double(groom.strand_position[at + 2])};
            const Point out{double(view.position[at]), double(view.position[at + 1]),
                            double(view.position[at + 2])};
            worst = std::max(worst, distance(out, rest));
            guides_only += distance(point(s, lane, p), rest) / (256 * 12);
        }
    }
    INFO(worst << " m off at worst; nearest guide " << guides_only << " m off in the mean");
    CHECK(worst < 1e-6);
    CHECK(guides_only > 0.005);
}

TEST_CASE("wind blows hair along, by its response, and turbulence differs by place and seed", "[acts]") {
    scenes::GroomOptions options;
    options.group.strand.wind_response = {0.2f};
    const scenes::Groom groom = head(64, 12, 0.2, options);
    const auto mean_x = [&](const Settings& settings) {
        Simulation s = made(groom, settings);
        run(s, 1.0, 1.0 / 60);
        double sum = 0;
        for (std::uint32_t lane : lanes_of(s)) sum += tip(s, lane)[0] / 64;
        return sum;
    };
    Settings still = single_thread(), windy = single_thread();
    windy.wind.velocity = {4, 0, 0};
    CHECK(mean_x(windy) > mean_x(still) + 0.03);

    const auto hash = [&](float gust, float turbulence, std::uint64_t seed) {
        Settings settings = windy;
        settings.wind.gust = gust;
        settings.wind.turbulence = turbulence;
        settings.seed = seed;
        Simulation s = made(groom, settings);
        run(s, 0.2, 1.0 / 60);
        return s.position_hash();
    };
    CHECK(hash(0.5f, 0.5f, 3) == hash(0.5f, 0.5f, 3));
    CHECK(hash(0.5f, 0.5f, 3) != hash(0.5f, 0.5f, 4));
    CHECK(hash(0.5f, 0, 3) != hash(0, 0, 3));
    CHECK(hash(0, 0.5f, 3) != hash(0, 0, 3));
}

TEST_CASE("damping takes the stated share of the speed", "[acts]") {
    scenes::GroomOptions options;
    options.group.strand.damping = {0.1f};
    Settings settings = single_thread();
    settings.gravity = {0, 0, 0};
    settings.passes.stretch = settings.passes.global_length = settings.passes.local_shape = false;
    const scenes::Line line = scenes::straight_line({0, 0, 0}, {1, 0, 0}, 0.2, 8);
    const scenes::Groom groom = scenes::make_groom({&line, 1}, options);
    Simulation s = made(groom, settings);
    must(s.set_gravity({0, -9.81f, 0}));
    must(s.step(1.0 / 60));
    must(s.set_gravity({0, 0, 0}));
    must(s.step(1.0 / 60));
    const double before = speed(s, 0, 5);
    for (int i = 0; i < 30; ++i) must(s.step(1.0 / 60));
    CHECK(speed(s, 0, 5) == Approx(before * std::pow(0.9, 30)).epsilon(0.01));
}
