#include "schema/layout.h"

#include <catch2/catch.hpp>

#include <set>

using namespace keratin;

TEST_CASE("every component of every lane of a row has a place of its own") {
    std::set<std::size_t> places;
    for (std::size_t row = 0; row < 5; ++row)
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t lane = 0; lane < kTileLanes; ++lane)
                places.insert(vector_index(row, 3, c, lane));
    CHECK(places.size() == 5 * 3 * kTileLanes);
    CHECK(*places.rbegin() == 5 * 3 * kTileLanes - 1);
}
