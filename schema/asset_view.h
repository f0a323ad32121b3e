// Opens an asset: maps the file, verifies it once, hands out spans into the mapping; packed
// positions alone are unpacked into memory of the view. The only reader of assets.
#pragma once

#include "schema/asset.h"
#include "schema/result.h"

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// full        structure, every index range, every number finite, and the hash over the whole file
// structure   the same without the hash (a corrupted number may pass; nothing can crash)
enum class Verify { full, structure };

class AssetView {
  public:
    // Maps the file read-only. Errors: io when it cannot be read; input when it is not an asset, is
    // of another major revision (the message names both and the command to rebake), is damaged, or
    // holds an index out of range (the message names field and element).
    static Result<AssetView> open(const std::string& path, Verify verify = Verify::full);
    // The same on bytes that the caller keeps alive and unchanged as long as the view; they must
    // start at a multiple of 32 bytes. `name` stands in the messages.
    static Result<AssetView> from_memory(std::span<const std::byte> bytes, const std::string& name,
                                         Verify verify = Verify::full);

    AssetView(AssetView&&) noexcept;
    AssetView& operator=(AssetView&&) noexcept;
    ~AssetView();

    const AssetInfo& info() const { return info_; }
    const AssetFields& fields() const { return fields_; }  // valid as long as the view
    std::span<const std::byte> bytes() const;              // the whole file

  private:
    struct Mapping;
    AssetView();
    Result<void> unpack(std::span<const std::uint32_t> packed, std::span<const float> root,
                        std::span<const float> step, const std::string& name);
    Result<void> read(std::span<const std::byte> bytes, const std::string& name, Verify verify);

    // Bulk fields start at multiples of 32 bytes, those made here too.
    static constexpr std::size_t kBlockFloats = 8;
    struct alignas(32) Block {
        float values[kBlockFloats];
    };

    std::unique_ptr<Mapping> mapping_;
    std::vector<Block> unpacked_;  // strand_position of an asset that stores it packed
    std::span<const std::byte> bytes_;
    AssetInfo info_;
    AssetFields fields_;
};

}  // namespace keratin
