// Bytes as an asset opener gets them: at a multiple of 32, and with the file's own size put right,
// which a reader checks before it looks at anything else.
#pragma once

#include "schema/file_hash.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

namespace keratin::fuzz {

class AssetInput {
  public:
    explicit AssetInput(std::string_view bytes)
        : blocks_(bytes.size() / sizeof(Block) + 1), size_(bytes.size()) {
        std::memcpy(blocks_.data(), bytes.data(), bytes.size());
        correct_size();
    }
    std::span<const std::byte> bytes() const {
        return {reinterpret_cast<const std::byte*>(blocks_.data()), size_};
    }
    // Puts the hash over the file right too.
    void correct_hash() {
        if (const std::size_t at = field_at(2, sizeof(Hash128))) {
            const Hash128 hash = hash_with_hole(bytes(), at, sizeof hash);
            std::memcpy(reinterpret_cast<std::byte*>(blocks_.data()) + at, &hash, sizeof hash);
        }
    }

  private:
    struct alignas(32) Block {
        std::byte bytes[32];
    };

    // Where field `id` of the root table (schema/asset.fbs) with `bytes` bytes stands, or 0; see
    // the FlatBuffers format.
    std::size_t field_at(std::size_t id, std::size_t bytes) const {
        const auto* data = reinterpret_cast<const std::uint8_t*>(blocks_.data());
        const std::size_t slot = 4 + 2 * id;
        std::uint32_t root = 0;
        std::int32_t to_vtable = 0;
        std::uint16_t field = 0;
        if (size_ < sizeof root) return 0;
        std::memcpy(&root, data, sizeof root);
        if (std::uint64_t{root} + sizeof to_vtable > size_) return 0;
        std::memcpy(&to_vtable, data + root, sizeof to_vtable);
        const std::int64_t entry = std::int64_t{root} - to_vtable + std::int64_t(slot);
        if (entry < 0 || std::uint64_t(entry) + sizeof field > size_) return 0;
        std::memcpy(&field, data + entry, sizeof field);
        if (field == 0 || std::uint64_t{root} + field + bytes > size_) return 0;
        return std::size_t{root} + field;
    }

    void correct_size() {
        const std::uint64_t size = size_;
        if (const std::size_t at = field_at(3, sizeof size))
            std::memcpy(reinterpret_cast<std::byte*>(blocks_.data()) + at, &size, sizeof size);
    }

    std::vector<Block> blocks_;
    std::size_t size_;
};

}  // namespace keratin::fuzz
