#include "runtime/contact/spin_barrier.h"

#include <catch2/catch.hpp>

#include <thread>
#include <vector>

using namespace keratin;

TEST_CASE("no thread passes a barrier before the last has come") {
    // More threads than cores: who waits must let the others run.
    constexpr std::uint32_t kThreads = 5, kRounds = 400;
    SpinBarrier barrier;
    std::vector<std::uint32_t> round(kThreads, 0);
    std::vector<std::uint32_t> early(kThreads, 0);
    std::vector<std::thread> threads;
    for (std::uint32_t t = 0; t < kThreads; ++t)
        threads.emplace_back([&, t] {
            for (std::uint32_t k = 1; k <= kRounds; ++k) {
                round[t] = k;
                barrier.wait(kThreads);
                for (const std::uint32_t other : round) early[t] += other != k;
                barrier.wait(kThreads);
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (const std::uint32_t e : early) CHECK(e == 0);
}
