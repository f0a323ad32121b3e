// The clock that passes are timed with: whatever the processor counts, turned into seconds by the
// whole step's own duration.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <x86intrin.h>
#else
#include <chrono>
#endif

namespace keratin {

inline std::uint64_t ticks() {
#if defined(__x86_64__)
    return __rdtsc();
#else
    return std::uint64_t(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

}  // namespace keratin
