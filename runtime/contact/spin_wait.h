// Where threads of one parallel region wait for each other.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace keratin {

// Waits for what comes within microseconds: too soon for the thread to sleep, as OpenMP's own
// barrier has it do in a host that lets its threads spin for a short while only. Who waits longer
// hands its core to others.
template <class Condition>
void spin_until(Condition&& holds) {
    constexpr int kSpins = 2000;
    for (int spin = 0; !holds();) {
        if (spin == kSpins) {
            std::this_thread::yield();
            continue;
        }
        ++spin;
#if defined(__x86_64__)
        _mm_pause();
#endif
    }
}

class SpinBarrier {
  public:
    // All `threads` call it; none goes on before the last has come. What each wrote before is seen
    // by all after.
    void wait(std::uint32_t threads) {
        if (threads <= 1) return;
        const std::uint32_t round = round_.load(std::memory_order_relaxed);
        if (arrived_.fetch_add(1, std::memory_order_acq_rel) + 1 == threads) {
            arrived_.store(0, std::memory_order_relaxed);
            round_.store(round + 1, std::memory_order_release);
            return;
        }
        spin_until([&] { return round_.load(std::memory_order_acquire) != round; });
    }

  private:
    // Apart, or who arrives would disturb who waits.
    alignas(64) std::atomic<std::uint32_t> arrived_ = 0;
    alignas(64) std::atomic<std::uint32_t> round_ = 0;
};

// Turns at something that one thread at a time may touch, in an order that all know.
class SpinTurns {
  public:
    // Until `turn` turns are over. What was written in them is seen afterwards.
    void wait_for(std::uint32_t turn) const {
        spin_until([&] { return over_.load(std::memory_order_acquire) == turn; });
    }
    // Ends the turn; of whoever has it.
    void end() {
        over_.store(over_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    }

  private:
    alignas(64) std::atomic<std::uint32_t> over_ = 0;
};

}  // namespace keratin
