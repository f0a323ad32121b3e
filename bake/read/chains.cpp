#include "bake/read/chains.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace keratin {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;

// What is known of a vertex: its part (union-find) and its first two neighbours.
struct Node {
    std::uint32_t parent = 0;
    std::array<std::uint32_t, 2> neighbour = {kNone, kNone};
    bool is_fork = false;
};

std::uint32_t part_of(std::vector<Node>& nodes, std::uint32_t v) {
    while (nodes[v].parent != v) {
        nodes[v].parent = nodes[nodes[v].parent].parent;
        v = nodes[v].parent;
    }
    return v;
}

void add_neighbour(Node& node, std::uint32_t other) {
    for (std::uint32_t& slot : node.neighbour) {
        if (slot == other) return;
        if (slot == kNone) {
            slot = other;
            return;
        }
    }
    node.is_fork = true;
}

}  // namespace

std::vector<Chain> build_chains(std::span<const Edge> edges, std::size_t vertex_count) {
    assert(vertex_count < kNone);
    std::vector<Node> nodes(vertex_count);
    for (std::uint32_t v = 0; v < vertex_count; ++v) nodes[v].parent = v;
    for (const Edge& edge : edges) {
        if (edge.a == edge.b) continue;
        add_neighbour(nodes[edge.a], edge.b);
        add_neighbour(nodes[edge.b], edge.a);
        const std::uint32_t a = part_of(nodes, edge.a), b = part_of(nodes, edge.b);
        // The lower number stands for the part: the result does not depend on the edges' order.
        nodes[std::max(a, b)].parent = std::min(a, b);
    }

    std::vector<Chain> chains;
    std::vector<std::uint32_t> chain_of(vertex_count, kNone);  // by the part's vertex
    for (std::size_t e = 0; e < edges.size(); ++e) {
        std::uint32_t& chain = chain_of[part_of(nodes, edges[e].a)];
        if (chain != kNone) continue;
        chain = static_cast<std::uint32_t>(chains.size());
        chains.push_back({{}, e, ChainFault::loop, edges[e].a});
        if (edges[e].a == edges[e].b && nodes[edges[e].a].neighbour[0] == kNone)
            chains.back().fault = ChainFault::one_point;
    }
    for (std::uint32_t v = 0; v < vertex_count; ++v) {
        const std::uint32_t index = chain_of[part_of(nodes, v)];
        if (index == kNone || nodes[v].neighbour[0] == kNone) continue;
        Chain& chain = chains[index];
        const bool is_end = nodes[v].neighbour[1] == kNone;
        if (nodes[v].is_fork && chain.fault != ChainFault::fork) {
            chain.fault = ChainFault::fork;
            chain.vertex = v;
        } else if (is_end && chain.fault == ChainFault::loop) {
            chain.fault = ChainFault::none;
            chain.vertex = v;
        }
    }
    for (Chain& chain : chains) {
        if (chain.fault != ChainFault::none) continue;
        std::uint32_t before = kNone;
        for (std::uint32_t v = chain.vertex; v != kNone;) {
            chain.vertices.push_back(v);
            const auto& [first, second] = nodes[v].neighbour;
            const std::uint32_t next = first == before ? second : first;
            before = v;
            v = next;
        }
    }
    return chains;
}

}  // namespace keratin
