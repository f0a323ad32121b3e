// The frame of keratin-bench: what a section may use and what it hands back. A section is one file
// with one function, listed in sections.h.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace keratin::bench {

// What the machine gives at best, measured beside the benchmarks on one thread.
struct Machine {
    std::string processor, instruction_set;
    int cores = 1;
    double fma_gflops = 0;   // float multiply-add, in registers
    double copy_gbytes = 0;  // read and written, far beyond the caches
    // Whether targets in ns and ms hold here: AVX-512 and the multiply-add rate of the machine that
    // they were set on.
    bool like_reference = false;
};

Machine measure_machine();

struct Row {
    std::string name;
    double value = 0;
    std::string unit;
    std::optional<double> target;
    bool smaller_is_better = true;
    bool absolute = false;  // in ns or ms: only judged on a machine like the reference
    std::optional<double> ratio_to_reference;  // how many times faster than the naive loop
    int threads = 1;
    std::optional<double> utilisation;  // busy share of the threads

    // Empty where the target does not hold on this machine or there is none.
    std::optional<bool> ok(const Machine& machine) const;
};

// CPU time of the calling thread, s.
double thread_seconds();

struct Timing {
    double seconds = 0;      // CPU time, the largest of any thread, smallest over the repeats
    double utilisation = 1;  // sum over threads / (threads * largest), at that repeat
};

struct Options {
    bool quick = false;  // fewer repeats and the small sizes only
    int threads = 0;     // 0: 1 and 2
    int repeats() const { return quick ? 5 : 20; }
};

// Runs work() and returns the best of options.repeats() repeats. work() may use OpenMP with
// `threads` threads. prepare() comes before each and is not timed.
Timing best_of(const Options& options, int threads, const std::function<void()>& work,
               const std::function<void()>& prepare = [] {});

struct Report {
    const Options& options;
    const Machine& machine;
    std::vector<Row> rows;
};

}  // namespace keratin::bench
