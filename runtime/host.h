// What a game engine may lend to a simulation: its memory, a place for messages, its threads. Each function is
// called with `user`; what is left null is done the ordinary way (operator new, no messages,
// OpenMP).
#pragma once

#include <cstddef>
#include <cstdint>

namespace keratin {

enum class LogLevel { note, warning };

struct Host {
    void* user = nullptr;
    // `bytes` (> 0) at a multiple of `alignment` (64); nullptr: there are none, and create() fails.
    // Called by create() alone, once for each buffer of the plan (Stats::bytes in all), and release
    // for each by the destructor, on the threads of their callers. Both are given, or neither.
    void* (*allocate)(void* user, std::size_t bytes, std::size_t alignment) = nullptr;
    void (*release)(void* user, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
    // One line without an end of line, valid during the call; from the thread that creates or steps.
    // note: what was made. warning: strands that were reset, roots that were refused.
    void (*log)(void* user, LogLevel level, const char* message) = nullptr;
    // Calls task(context, k) once for each k = 0 .. count - 1, on any threads, at the same time or one
    // after the other, and returns when all have returned. count is at most Settings::threads. Called
    // several times in a step, from the thread that steps; a task starts no other.
    void (*parallel)(void* user, std::uint32_t count, void (*task)(void* context, std::uint32_t k),
                     void* context) = nullptr;
};

}  // namespace keratin
