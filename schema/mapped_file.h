// A file mapped read-only into memory, on POSIX systems and Windows.
#pragma once

#include "schema/result.h"

#include <cstddef>
#include <span>
#include <string>

namespace keratin {

class MappedFile {
  public:
    // Error io: missing, unreadable, or not a regular file; input: empty.
    static Result<MappedFile> open(const std::string& path);

    MappedFile(MappedFile&& other) noexcept;
    MappedFile& operator=(MappedFile&& other) noexcept;
    ~MappedFile();

    // Starts at a page boundary; valid as long as this object.
    std::span<const std::byte> bytes() const { return bytes_; }

  private:
    explicit MappedFile(std::span<const std::byte> bytes) : bytes_(bytes) {}
    std::span<const std::byte> bytes_;
};

}  // namespace keratin
