// Reading and writing whole files, for programs. The runtime library does not link this.
#pragma once

#include "schema/result.h"

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace keratin {

// Replaces the file at path by the bytes: they go to a temporary file beside it, which is then
// renamed, so that a failed run never leaves half a file or touches the old one. A link is
// followed; something that is not a regular file (/dev/stdout) is written directly. Error io.
Result<void> write_file(const std::string& path, std::span<const std::byte> bytes);
Result<void> write_file(const std::string& path, std::string_view text);

// The whole content of a regular file. Error io.
Result<std::vector<std::byte>> read_file(const std::string& path);

// A file that is filled piece by piece and takes its place at path when commit() succeeds; without
// commit() nothing is left behind.
class PendingFile {
  public:
    static Result<PendingFile> create(const std::string& path);
    PendingFile(PendingFile&& other) noexcept;
    PendingFile& operator=(PendingFile&& other) noexcept;
    ~PendingFile();

    Result<void> write(std::span<const std::byte> bytes);
    Result<void> write(std::string_view text);
    // Replaces bytes already written, for headers that are known last; the place must exist.
    Result<void> overwrite(std::size_t offset, std::span<const std::byte> bytes);
    Result<void> commit();
    // Where the bytes are until commit(), for libraries that write files themselves.
    const std::string& temporary_path() const { return temporary_; }

  private:
    PendingFile() = default;
    std::string path_, temporary_;  // temporary_ == path_: written directly
    int file_ = -1;
};

}  // namespace keratin
