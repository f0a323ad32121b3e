// Shares a loop among threads, OpenMP's or the host's: the one place of the strand runtime where
// threads begin. Nothing may depend on who does what.
#pragma once

#include "runtime/host.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <omp.h>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace keratin {

// Numbers too small for float's full precision count as zero while the passes run: hair that comes
// to rest is full of them, and each costs the processor a hundred times an ordinary one. The
// caller's setting comes back afterwards.
class SmallAsZero {
  public:
#if defined(__x86_64__)
    SmallAsZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040u); }
    ~SmallAsZero() { _mm_setcsr(before_); }
    SmallAsZero(const SmallAsZero&) = delete;
    SmallAsZero& operator=(const SmallAsZero&) = delete;

  private:
    unsigned before_;
#endif
};

namespace detail {
// Which of a loop's workers this thread is; 0 outside of loops.
inline thread_local std::uint32_t worker = 0;

class Worker {
  public:
    explicit Worker(std::uint32_t index) : before_(worker) { worker = index; }
    ~Worker() { worker = before_; }
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

  private:
    std::uint32_t before_;
    SmallAsZero flush_;
};
}  // namespace detail

// 0 .. threads - 1; no two that run at the same time in one loop have the same.
inline std::uint32_t worker_index() { return detail::worker; }

// body(i) for i = 0 .. count - 1, `grain` at a time.
template <class Body>
void share(const Host& host, int threads, std::size_t count, std::size_t grain, const Body& body) {
    const std::size_t parts = (count + grain - 1) / grain;
    const int workers = int(std::min<std::size_t>(std::size_t(threads), parts));
    if (workers <= 1) {
        const detail::Worker self(0);
        for (std::size_t i = 0; i < count; ++i) body(i);
        return;
    }
    if (host.parallel) {
        struct Loop {
            const Body& body;
            std::size_t count, grain;
            std::atomic<std::size_t> next{0};
        } loop{body, count, grain};
        const auto work = [](void* context, std::uint32_t index) {
            Loop& l = *static_cast<Loop*>(context);
            const detail::Worker self(index);
            for (;;) {
                const std::size_t first = l.next.fetch_add(l.grain);
                if (first >= l.count) return;
                for (std::size_t i = first; i < std::min(l.count, first + l.grain); ++i) l.body(i);
            }
        };
        host.parallel(host.user, std::uint32_t(workers), work, &loop);
        return;
    }
#pragma omp parallel num_threads(workers)
    {
        const detail::Worker self{static_cast<std::uint32_t>(omp_get_thread_num())};
#pragma omp for schedule(static, 1) nowait
        for (std::size_t part = 0; part < parts; ++part)
            for (std::size_t i = part * grain; i < std::min(count, (part + 1) * grain); ++i) body(i);
    }
}

// Grain for loops whose items cost the same: one part a worker.
inline std::size_t even_grain(std::size_t count, int threads) {
    return std::max<std::size_t>(1, (count + std::size_t(threads) - 1) / std::size_t(threads));
}

}  // namespace keratin
