// How a bake leaves its files behind for build tools.
#pragma once

#include "schema/result.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// What happens to the time stamp of a file whose bytes are already right. Make rebuilds for ever
// when an output stays older than its input; Ninja skips what follows when it keeps its time.
enum class Unchanged { touch, keep_time };

// Writes the bytes to path unless the file holds them already; true when it was written. A failed
// write leaves the old file as it was. Error io.
Result<bool> write_if_changed(const std::string& path, std::span<const std::byte> bytes,
                              Unchanged unchanged);

// A dependency file for Make and Ninja: `output` as named on the command line, then absolute paths
// of the inputs, sorted, each once.
std::string dependency_text(const std::string& output, std::span<const std::string> inputs);

}  // namespace keratin
