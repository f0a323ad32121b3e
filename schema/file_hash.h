// XXH3-128 hashes: of a file's content, and of an asset with the place of its own hash zeroed.
#pragma once

#include "schema/asset.h"

#include <cstddef>
#include <span>

namespace keratin {

Hash128 hash_bytes(std::span<const std::byte> bytes);

// Hash of `bytes` with the `hole_size` bytes from `hole` on read as zeros.
Hash128 hash_with_hole(std::span<const std::byte> bytes, std::size_t hole, std::size_t hole_size);

// 32 lower-case hexadecimal digits, high half first.
std::string to_string(const Hash128& hash);

}  // namespace keratin
