// Speed of the rod solver without contact.
#include "runtime/rod/rod_simulation.h"
#include "tools/keratin-bench/sections.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace keratin::bench {

namespace {

// The machine's speed comes and goes: what is compared is measured in turns, so often.
constexpr int kRounds = 5;

// Strands from the upper half of a sphere, radial, spread over a golden spiral.
std::vector<RodStrand> hair(std::size_t strands, std::size_t vertices) {
    std::vector<RodStrand> all(strands);
    for (std::size_t s = 0; s < strands; ++s) {
        const double up = (static_cast<double>(s) + 0.5) / static_cast<double>(strands);
        const double turn = 2.399963229728653 * static_cast<double>(s),
                     flat = std::sqrt(1 - up * up);
        const Double3 d{flat * std::cos(turn), up, flat * std::sin(turn)};
        for (std::size_t i = 0; i < vertices; ++i) {
            const double r =
                0.15 + 0.2 * static_cast<double>(i) / static_cast<double>(vertices - 1);
            all[s].points.push_back({r * d[0], r * d[1], r * d[2]});
        }
        all[s].material.youngs_modulus = 8e8;
        all[s].material.poisson_ratio = 0.36;
        all[s].material.density = 1320;
        all[s].natural_curvature = {{2, 5}};
    }
    return all;
}

RodSimulation simulate(const std::vector<RodStrand>& strands, const RodSettings& settings) {
    auto rods = RodSimulation::create(strands, settings);
    if (!rods) throw std::runtime_error(to_string(rods.error()));
    return std::move(*rods);
}

struct StepTime {
    Timing time;
    double iterations = 0;  // of Newton's method, mean over the strands
};

// One 1 ms step from a given state.
StepTime step_time(const Options& options, const std::vector<RodStrand>& strands,
                   const std::vector<std::byte>& state, const RodSettings& settings) {
    RodSimulation rods = simulate(strands, settings);
    StepTime out;
    out.time = best_of(
        options, settings.threads,
        [&] {
            const auto report = rods.step(1e-3);
            out.iterations =
                static_cast<double>(report->iterations) / static_cast<double>(strands.size());
        },
        [&] { (void)rods.restore(state); });
    return out;
}

// `settings` with a step that is cut off after `iterations` quasi-Newton iterations.
RodSettings cut_off(RodSettings settings, std::uint32_t iterations) {
    settings.iterations = iterations;
    settings.tolerance = 0;
    settings.halvings = 0;
    return settings;
}

// After a few steps of falling they bend and twist everywhere.
std::vector<std::byte> fallen(const std::vector<RodStrand>& strands, const RodSettings& settings) {
    RodSimulation rods = simulate(strands, settings);
    for (int k = 0; k < 10; ++k) (void)rods.step(1e-3);
    return rods.save();
}

// A step of 20 iterations: strands converge to rounding before that many, so one step cut off after
// 2 iterations and one after 6 give the cost of an iteration.
class TwentyIterations {
  public:
    TwentyIterations(std::size_t strand_count, std::size_t vertices, int threads,
                     InstructionSet set)
        : strands_(hair(strand_count, vertices)) {
        settings_.threads = threads;
        settings_.instruction_set = set;
        state_ = fallen(strands_, settings_);
    }
    // Once more; what counts is the least of all times.
    void measure(const Options& options) {
        for (StepTime* step : {&few_, &more_}) {
            const StepTime now =
                step_time(options, strands_, state_, cut_off(settings_, step == &few_ ? 2 : 6));
            if (step->iterations == 0 || now.time.seconds < step->time.seconds) *step = now;
        }
    }
    double seconds() const {
        const double each =
            (more_.time.seconds - few_.time.seconds) / (more_.iterations - few_.iterations);
        return few_.time.seconds + (20 - few_.iterations) * each;
    }
    double utilisation() const { return more_.time.utilisation; }

  private:
    std::vector<RodStrand> strands_;
    RodSettings settings_;
    std::vector<std::byte> state_;
    StepTime few_, more_;
};

std::string row_name(std::size_t strands, std::size_t vertices) {
    return "rod step, " + std::to_string(strands) + " strands x " + std::to_string(vertices) +
           " vertices, 20 quasi-Newton iterations";
}

// Slope of the straight line nearest to the points (x, y), least squares.
double slope(const std::vector<double>& x, const std::vector<double>& y) {
    double mean_x = 0, mean_y = 0, square = 0, product = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        mean_x += x[i] / static_cast<double>(x.size());
        mean_y += y[i] / static_cast<double>(x.size());
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        square += (x[i] - mean_x) * (x[i] - mean_x);
        product += (x[i] - mean_x) * (y[i] - mean_y);
    }
    return product / square;
}

}  // namespace

void rod_section(Report& report) {
    // The slow reference, the same code without SIMD, takes a share of the strands.
    constexpr std::size_t kShare = 5, kStrands = 1000, kVertices = 40;
    const Options& options = report.options;
    TwentyIterations scalar(kStrands / kShare, kVertices, 1, InstructionSet::baseline);
    std::vector<std::pair<int, TwentyIterations>> wide;  // by threads
    for (const int threads : {1, 2})
        if (options.threads == 0 || threads == options.threads)
            wide.emplace_back(
                threads, TwentyIterations(kStrands, kVertices, threads, InstructionSet::automatic));
    for (int round = 0; round < kRounds; ++round) {
        scalar.measure(options);
        for (auto& [threads, times] : wide) times.measure(options);
    }
    const double reference = kShare * scalar.seconds();
    for (const auto& [threads, times] : wide) {
        Row row;
        row.name = row_name(kStrands, kVertices);
        row.value = 1e3 * times.seconds();
        row.unit = "ms";
        row.target = threads == 1 ? 36 : 19;
        row.absolute = true;
        row.threads = threads;
        row.utilisation = times.utilisation();
        if (threads == 1) row.ratio_to_reference = reference / times.seconds();
        report.rows.push_back(row);
        if (threads > 1) continue;
        Row ratio;
        ratio.name = row.name + ": times faster than its scalar build";
        ratio.value = reference / times.seconds();
        ratio.unit = "x";
        ratio.target = 6.5;
        ratio.smaller_is_better = false;
        report.rows.push_back(ratio);
    }
}

// How a step's time grows: two rows a size, and the exponents p of time = c size^p, fitted by least
// squares to the logarithms; linear is 1. One thread. Judged is the same work at every size, three
// iterations with one factor; beside it a whole step, whose number of factors the strands decide.
void rod_scaling_section(Report& report) {
    const Options& options = report.options;
    RodSettings settings;
    settings.threads = 1;
    const std::pair<const char*, RodSettings> kinds[] = {
        {"rod step of 3 quasi-Newton iterations, ", cut_off(settings, 3)},
        {"rod step to the tolerance of 1e-8 m/s, ", settings}};
    using Sizes = std::vector<std::size_t>;
    const auto grow = [&](const char* over, const Sizes& strand_counts,
                          const Sizes& vertex_counts) {
        struct Size {
            std::size_t strand_count, vertices;
            std::vector<RodStrand> strands;
            std::vector<std::byte> state;
            double seconds[2];
        };
        std::vector<Size> sizes;
        for (const std::size_t strand_count : strand_counts)
            for (const std::size_t vertices : vertex_counts) {
                std::vector<RodStrand> strands = hair(strand_count, vertices);
                std::vector<std::byte> state = fallen(strands, settings);
                sizes.push_back({strand_count,
                                 vertices,
                                 std::move(strands),
                                 std::move(state),
                                 {HUGE_VAL, HUGE_VAL}});
            }
        for (int round = 0; round < kRounds; ++round)
            for (Size& size : sizes)
                for (std::size_t k = 0; k < 2; ++k)
                    size.seconds[k] = std::min(
                        size.seconds[k],
                        step_time(options, size.strands, size.state, kinds[k].second).time.seconds);
        std::vector<double> log_size, log_time[2];
        for (const Size& size : sizes) {
            log_size.push_back(std::log(static_cast<double>(size.strand_count * size.vertices)));
            for (std::size_t k = 0; k < 2; ++k) {
                Row row;
                row.name = kinds[k].first + std::to_string(size.strand_count) + " strands x " +
                           std::to_string(size.vertices) + " vertices";
                row.value = 1e3 * size.seconds[k];
                row.unit = "ms";
                report.rows.push_back(row);
                log_time[k].push_back(std::log(size.seconds[k]));
            }
        }
        for (std::size_t k = 0; k < 2; ++k) {
            Row row;
            row.name = std::string(kinds[k].first) + "over " + over + ": exponent";
            row.value = slope(log_size, log_time[k]);
            if (k == 0) row.target = 1.1;
            report.rows.push_back(row);
        }
    };
    grow("strands",
         options.quick ? Sizes{250, 1000, 4000} : Sizes{250, 500, 1000, 2000, 4000, 8000, 16000},
         {40});
    grow("vertices", {1000}, options.quick ? Sizes{10, 40, 160} : Sizes{10, 20, 40, 80, 160});
}

}  // namespace keratin::bench
