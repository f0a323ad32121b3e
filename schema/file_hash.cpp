#include "schema/file_hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cassert>
#include <cstdio>

namespace keratin {

Hash128 hash_bytes(std::span<const std::byte> bytes) {
    const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
    return {hash.low64, hash.high64};
}

Hash128 hash_with_hole(std::span<const std::byte> bytes, std::size_t hole, std::size_t hole_size) {
    constexpr std::array<std::byte, 64> zeros{};
    assert(hole_size <= zeros.size() && hole + hole_size <= bytes.size());
    XXH3_state_t state;
    XXH3_128bits_reset(&state);
    XXH3_128bits_update(&state, bytes.data(), hole);
    XXH3_128bits_update(&state, zeros.data(), hole_size);
    XXH3_128bits_update(&state, bytes.data() + hole + hole_size, bytes.size() - hole - hole_size);
    const XXH128_hash_t hash = XXH3_128bits_digest(&state);
    return {hash.low64, hash.high64};
}

std::string to_string(const Hash128& hash) {
    std::array<char, 33> text{};
    std::snprintf(text.data(), text.size(), "%016llx%016llx",
                  static_cast<unsigned long long>(hash.high),
                  static_cast<unsigned long long>(hash.low));
    return text.data();
}

}  // namespace keratin
