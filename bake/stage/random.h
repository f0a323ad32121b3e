// Random numbers that are the same with every compiler and standard library.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

namespace keratin {

// SplitMix64 (Steele, Lea and Flood 2014).
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        state_ += 0x9e3779b97f4a7c15u;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }

    // Uniform in 0..count-1, count > 0: draws below 2^64 mod count are thrown away.
    std::uint64_t below(std::uint64_t count) {
        const std::uint64_t unfair = (0 - count) % count;
        std::uint64_t draw = next();
        while (draw < unfair) draw = next();
        return draw % count;
    }

    // Fisher and Yates: afterwards the first `count` items are a uniform choice without repetition.
    template <class T>
    void choose_first(std::span<T> items, std::size_t count) {
        for (std::size_t i = 0; i < count && i + 1 < items.size(); ++i) {
            std::swap(items[i], items[i + below(items.size() - i)]);
        }
    }

  private:
    std::uint64_t state_;
};

}  // namespace keratin
