// A file that lives in memory, for readers that take a path.
#pragma once

#include "tests/fuzz/demand.h"

#include <string>
#include <string_view>
#include <sys/mman.h>
#include <unistd.h>

namespace keratin::fuzz {

class MemoryFile {
  public:
    MemoryFile() : file_(memfd_create("state", 0)) { demand(file_ >= 0, "memory is a file"); }
    ~MemoryFile() { close(file_); }
    MemoryFile(const MemoryFile&) = delete;
    std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }
    void fill(std::string_view bytes) const {
        demand(write(file_, bytes.data(), bytes.size()) == ssize_t(bytes.size()), "it fills");
    }

  private:
    int file_;
};

}  // namespace keratin::fuzz
