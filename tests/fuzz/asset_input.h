// Bytes as an asset opener gets them: at a multiple of 32, and with the file's own size put right,
// which a reader checks before it looks at anything else.
#pragma once

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

  private:
    struct alignas(32) Block {
        std::byte bytes[32];
    };

    // file_size is field 3 of the root table (schema/asset.fbs); see the FlatBuffers format.
    void correct_size() {
        constexpr std::size_t kEntry = 4 + 2 * 3;
        auto* data = reinterpret_cast<std::uint8_t*>(blocks_.data());
        std::uint32_t root = 0;
        std::int32_t to_vtable = 0;
        std::uint16_t field = 0;
        if (size_ < sizeof root) return;
        std::memcpy(&root, data, sizeof root);
        if (std::uint64_t{root} + sizeof to_vtable > size_) return;
        std::memcpy(&to_vtable, data + root, sizeof to_vtable);
        const std::int64_t entry = std::int64_t{root} - to_vtable + std::int64_t{kEntry};
        if (entry < 0 || std::uint64_t(entry) + sizeof field > size_) return;
        std::memcpy(&field, data + entry, sizeof field);
        const std::uint64_t size = size_;
        if (field == 0 || std::uint64_t{root} + field + sizeof size > size_) return;
        std::memcpy(data + root + field, &size, sizeof size);
    }

    std::vector<Block> blocks_;
    std::size_t size_;
};

}  // namespace keratin::fuzz
