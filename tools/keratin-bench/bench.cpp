#include "tools/keratin-bench/bench.h"

#include "runtime/lane/instruction_set.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <omp.h>
#include <time.h>

namespace keratin::bench {

double thread_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

namespace {

std::string processor_name() {
    std::ifstream file("/proc/cpuinfo");
    std::string line;
    while (std::getline(file, line))
        if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
    return "unknown";
}

using Float16 = float __attribute__((vector_size(64)));

// Twelve independent chains hide the latency on any processor of today.
constexpr int kChains = 12, kRounds = 20000;

#if defined(__x86_64__)
__attribute__((target("avx512f"), optimize("fp-contract=fast"), noinline)) void fma_chains(
    float* out) {
    Float16 a[kChains];
    for (int i = 0; i < kChains; ++i) a[i] = Float16{} + out[i];
    const Float16 m = Float16{} + out[0], b = Float16{} + out[1];
    for (int r = 0; r < kRounds; ++r)
        for (int i = 0; i < kChains; ++i) a[i] = a[i] * m + b;
    for (int i = 0; i < kChains; ++i) std::memcpy(out + 16 * i, &a[i], 64);
}
using Float8 = float __attribute__((vector_size(32)));
__attribute__((target("avx2,fma"), optimize("fp-contract=fast"), noinline)) void fma_chains_avx2(
    float* out) {
    Float8 a[kChains];
    for (int i = 0; i < kChains; ++i) a[i] = Float8{} + out[i];
    const Float8 m = Float8{} + out[0], b = Float8{} + out[1];
    for (int r = 0; r < kRounds; ++r)
        for (int i = 0; i < kChains; ++i) a[i] = a[i] * m + b;
    for (int i = 0; i < kChains; ++i) std::memcpy(out + 16 * i, &a[i], 32);
}
#endif

double fma_rate(InstructionSet set) {
    alignas(64) static float out[kChains * 16];
    double best = std::numeric_limits<double>::max();
    double lanes = 4;
    for (int repeat = 0; repeat < 40; ++repeat) {
        for (float& v : out) v = 0.5f;
        const double start = thread_seconds();
#if defined(__x86_64__)
        if (set == InstructionSet::avx512) {
            fma_chains(out);
            lanes = 16;
        } else if (set == InstructionSet::avx2) {
            fma_chains_avx2(out);
            lanes = 8;
        }
#endif
        best = std::min(best, thread_seconds() - start);
    }
    return 2.0 * lanes * kChains * kRounds / best * 1e-9;
}

double copy_rate() {
    // Eight times any last-level cache share that two cores are likely to see.
    const std::size_t bytes = std::size_t{128} << 20;
    std::vector<char> from(bytes, 1), to(bytes, 2);
    double best = std::numeric_limits<double>::max();
    for (int repeat = 0; repeat < 6; ++repeat) {
        const double start = thread_seconds();
        std::memcpy(to.data(), from.data(), bytes);
        best = std::min(best, thread_seconds() - start);
        from[0] = to[bytes - 1];
    }
    return 2.0 * double(bytes) / best * 1e-9;
}

}  // namespace

Machine measure_machine() {
    Machine m;
    m.processor = processor_name();
    m.cores = omp_get_num_procs();
    const InstructionSet set = usable_instruction_set(InstructionSet::automatic);
    m.instruction_set = set == InstructionSet::avx512 ? "avx512"
                        : set == InstructionSet::avx2 ? "avx2"
                                                      : "baseline";
    m.fma_gflops = fma_rate(set);
    m.copy_gbytes = copy_rate();
    // The targets come from a core with two 512-bit multiply-adds a cycle at 4.1 GHz: 262 GFLOP/s.
    constexpr double kReferenceGflops = 262;
    m.like_reference = set == InstructionSet::avx512 && m.fma_gflops > 0.85 * kReferenceGflops;
    return m;
}

std::optional<bool> Row::ok(const Machine& machine) const {
    if (!target || (absolute && !machine.like_reference)) return std::nullopt;
    return smaller_is_better ? value <= *target : value >= *target;
}

Timing best_of(const Options& options, int threads, const std::function<void()>& work,
               const std::function<void()>& prepare) {
    Timing best{std::numeric_limits<double>::max(), 1};
    const auto count = static_cast<std::size_t>(threads);
    std::vector<double> before(count), after(count);
    const auto clock = [&](std::vector<double>& out) {
#pragma omp parallel num_threads(threads)
        out[std::size_t(omp_get_thread_num())] = thread_seconds();
    };
    prepare();
    work();
    for (int repeat = 0; repeat < options.repeats(); ++repeat) {
        prepare();
        clock(before);
        work();
        clock(after);
        double largest = 0, sum = 0;
        for (std::size_t t = 0; t < before.size(); ++t) {
            largest = std::max(largest, after[t] - before[t]);
            sum += after[t] - before[t];
        }
        if (largest < best.seconds) best = {largest, sum / (threads * largest)};
    }
    return best;
}

}  // namespace keratin::bench
