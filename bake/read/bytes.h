// Files as text or as little-endian fields.
#pragma once

#include "schema/mapped_file.h"

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace keratin {

// The bytes of a mapped file, valid as long as it is.
inline std::string_view text_of(const MappedFile& file) {
    return {reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()};
}

// A little-endian number at `offset`, which must lie inside `bytes`.
template <class T>
T load(std::string_view bytes, std::size_t offset) {
    static_assert(std::endian::native == std::endian::little && std::is_arithmetic_v<T>);
    assert(offset <= bytes.size() && sizeof(T) <= bytes.size() - offset);
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
}

// Whether `count` items of `size` bytes lie inside `bytes` from `offset` on; free of overflow.
inline bool holds(std::string_view bytes, std::uint64_t offset, std::uint64_t count,
                  std::uint64_t size) {
    return offset <= bytes.size() && (size == 0 || count <= (bytes.size() - offset) / size);
}

}  // namespace keratin
