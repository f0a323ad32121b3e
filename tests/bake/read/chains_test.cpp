#include "bake/read/chains.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <random>

using namespace keratin;

TEST_CASE("edges in any order and direction make the chains they were cut from") {
    // Two chains: 3 1 0 4 and 2 5 6.
    std::vector<Edge> edges = {{3, 1}, {1, 0}, {0, 4}, {2, 5}, {5, 6}};
    std::mt19937 random(5);
    for (int round = 0; round < 20; ++round) {
        std::shuffle(edges.begin(), edges.end(), random);
        for (Edge& edge : edges)
            if (random() % 2) std::swap(edge.a, edge.b);
        auto chains = build_chains(edges, 8);
        REQUIRE(chains.size() == 2);
        CHECK(chains[0].first_edge == 0);
        std::sort(chains.begin(), chains.end(), [](const Chain& a, const Chain& b) {
            return a.vertices.front() < b.vertices.front();
        });
        CHECK(chains[0].vertices == std::vector<std::uint32_t>{2, 5, 6});
        CHECK(chains[1].vertices == std::vector<std::uint32_t>{3, 1, 0, 4});
    }
}

TEST_CASE("forks, loops and lone points are told apart and leave the other chains alone") {
    const std::vector<Edge> edges = {{0, 1}, {0, 2}, {0, 3},   // a fork at 0
                                     {4, 5}, {5, 6}, {6, 4},   // a loop
                                     {7, 7},                   // a point
                                     {8, 9}, {9, 8}, {9, 9}};  // one segment, said twice
    const auto chains = build_chains(edges, 10);
    REQUIRE(chains.size() == 4);
    CHECK(chains[0].fault == ChainFault::fork);
    CHECK(chains[0].vertex == 0);
    CHECK(chains[1].fault == ChainFault::loop);
    CHECK(chains[2].fault == ChainFault::one_point);
    CHECK(chains[2].vertex == 7);
    CHECK(chains[3].fault == ChainFault::none);
    CHECK(chains[3].vertices == std::vector<std::uint32_t>{8, 9});
}
