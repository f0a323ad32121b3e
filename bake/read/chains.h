// Strands out of loose edges, as exporters write them in any order and direction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

struct Edge {
    std::uint32_t a = 0, b = 0;
};

enum class ChainFault {
    none,
    fork,       // `vertex` has more than two edges
    loop,       // closed: there is no end to start from
    one_point,  // its only edges join `vertex` with itself
};

struct Chain {
    std::vector<std::uint32_t> vertices;  // from the end with the lower number; empty if faulty
    std::size_t first_edge = 0;           // the first of its edges in the list
    ChainFault fault = ChainFault::none;
    std::uint32_t vertex = 0;
};

// The connected parts of the edges, in the order of their first edges. An edge that stands in the
// list twice counts once; one that joins a vertex with itself counts for nothing.
// Vertices are < vertex_count.
std::vector<Chain> build_chains(std::span<const Edge> edges, std::size_t vertex_count);

}  // namespace keratin
