// The body from a mesh file, for assets that do not store it.
#pragma once

#include "schema/result.h"

#include <cstdint>
#include <string>
#include <vector>

namespace keratin::view {

struct BodyMesh {
    std::vector<float> position;          // [vertices * 3] m
    std::vector<std::uint32_t> triangle;  // [triangles * 3]
};

// Positions of the file times scale (m a unit). Errors: those of the bake's mesh reader;
// unsupported in a build without the bake.
Result<BodyMesh> read_body(const std::string& path, double scale);

}  // namespace keratin::view
