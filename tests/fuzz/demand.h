// What a reader promises of what it accepts: a broken promise aborts, so that it is found like a
// crash.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace keratin::fuzz {

inline void demand(bool holds, const char* promise) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}

}  // namespace keratin::fuzz
