#include "bake/read/bytes.h"
#include "bake/read/formats.h"

#include <cmath>
#include <string>

namespace keratin {

// u32 version (1), strands, triangles, 31 reserved, offset of the map, offset of the uvw, 31
// reserved: 268 bytes. Map: u32 mesh, u32 triangle, f32 barycentric[3], u32 reserved a strand.
// Then f32 uvw[3] a strand.
Result<RawBinding> read_tfxskin(std::string_view bytes, const std::string& file) {
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file, what};
    };
    constexpr std::size_t kHeaderSize = 268, kEntrySize = 24, kUvwSize = 12;
    if (bytes.size() < kHeaderSize) return damaged("the file ends inside its header; it is cut");
    if (load<std::uint32_t>(bytes, 0) != 1)
        return damaged("this is not a .tfxskin file, version 1");
    const auto strands = load<std::uint32_t>(bytes, 4);
    RawBinding binding;
    binding.mesh_triangle_count = load<std::uint32_t>(bytes, 8);
    const auto map_at = load<std::uint32_t>(bytes, 136), uvw_at = load<std::uint32_t>(bytes, 140);
    if (strands == 0) return damaged("the file holds no strands");
    if (map_at < kHeaderSize || !holds(bytes, map_at, strands, kEntrySize))
        return damaged("the bindings of its " + std::to_string(strands) +
                       " strands lie outside the file; it is cut");
    if (uvw_at != 0 && (uvw_at < kHeaderSize || !holds(bytes, uvw_at, strands, kUvwSize)))
        return damaged("the texture coordinates of its strands lie outside the file; it is cut");
    for (std::size_t s = 0; s < strands; ++s) {
        const std::size_t at = map_at + s * kEntrySize;
        const std::string place = "strand " + std::to_string(s) + ": ";
        const auto triangle = load<std::uint32_t>(bytes, at + 4);
        if (triangle >= binding.mesh_triangle_count)
            return damaged(place + "triangle " + std::to_string(triangle) + " is out of range (" +
                           std::to_string(binding.mesh_triangle_count) + " triangles)");
        binding.mesh.push_back(load<std::uint32_t>(bytes, at));
        binding.triangle.push_back(triangle);
        std::array<double, 3> barycentric{}, uvw{};
        for (std::size_t k = 0; k < 3; ++k) {
            barycentric[k] = load<float>(bytes, at + 8 + 4 * k);
            if (uvw_at != 0) uvw[k] = load<float>(bytes, uvw_at + s * kUvwSize + 4 * k);
            if (!std::isfinite(barycentric[k]) || !std::isfinite(uvw[k]))
                return damaged(place + "a number is not finite");
        }
        binding.barycentric.push_back(barycentric);
        if (uvw_at != 0) binding.uvw.push_back(uvw);
    }
    return binding;
}

}  // namespace keratin
