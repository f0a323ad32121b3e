#include "runtime/contact/spin_wait.h"

#include <catch2/catch.hpp>

#include <algorithm>
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

TEST_CASE("turns come in their order, whoever waits for them") {
    // Thread t takes every kThreads-th turn, from t on.
    constexpr std::uint32_t kThreads = 5, kTurns = 2000;
    SpinTurns turns;
    std::vector<std::uint32_t> seen;  // written by whoever's turn it is
    seen.reserve(kTurns);
    std::vector<std::thread> threads;
    for (std::uint32_t t = 0; t < kThreads; ++t)
        threads.emplace_back([&, t] {
            for (std::uint32_t turn = t; turn < kTurns; turn += kThreads) {
                turns.wait_for(turn);
                seen.push_back(turn);
                turns.end();
            }
        });
    for (std::thread& thread : threads) thread.join();
    REQUIRE(seen.size() == kTurns);
    CHECK(std::ranges::is_sorted(seen));
}
