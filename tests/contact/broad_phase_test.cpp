#include "runtime/contact/broad_phase.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <random>

using namespace keratin;

namespace {

using Boxes = std::vector<Box>;

// Boxes of edge lengths up to `size` in the unit cube; every `large_every`-th is 30 times as large.
Boxes random_boxes(std::size_t count, float size, std::size_t large_every, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    Boxes boxes(count);
    for (std::size_t i = 0; i < count; ++i)
        for (int a = 0; a < 3; ++a) {
            const float low = unit(random),
                        extent = size * unit(random) *
                                 (large_every > 0 && i % large_every == 0 ? 30 : 1);
            boxes[i].bound[a] = low;
            boxes[i].bound[3 + a] = low + extent;
        }
    return boxes;
}

std::vector<BoxPair> brute_force(const Boxes& boxes) {
    std::vector<BoxPair> pairs;
    const auto n = static_cast<std::uint32_t>(boxes.size());
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = i + 1; j < n; ++j) {
            bool overlap = true;
            for (int a = 0; a < 3; ++a)
                overlap &= boxes[i].bound[a] <= boxes[j].bound[3 + a] &&
                           boxes[j].bound[a] <= boxes[i].bound[3 + a];
            if (overlap) pairs.push_back({i, j});
        }
    return pairs;
}

std::vector<BoxPair> found_by(const Boxes& b, BroadPhaseMethod method, int threads,
                              InstructionSet set = InstructionSet::automatic) {
    BroadPhase broad;
    std::vector<BoxPair> pairs;
    broad.find_pairs(b, threads, pairs, method, set);
    return pairs;
}

std::vector<BoxPair> sorted(std::vector<BoxPair> pairs) {
    std::sort(pairs.begin(), pairs.end(), [](const BoxPair& l, const BoxPair& r) {
        return l.first != r.first ? l.first < r.first : l.second < r.second;
    });
    return pairs;
}

}  // namespace

TEST_CASE("grid and tree find exactly the overlapping boxes") {
    for (const std::size_t count : {2, 15, 16, 17, 255, 257, 3000, 5000}) {
        const Boxes b = random_boxes(count, 0.05f, 0, static_cast<unsigned>(count));
        const std::vector<BoxPair> expected = brute_force(b);
        INFO(count << " boxes");
        CHECK(sorted(found_by(b, BroadPhaseMethod::grid, 1)) == expected);
        CHECK(sorted(found_by(b, BroadPhaseMethod::tree, 1)) == expected);
        CHECK(sorted(found_by(b, BroadPhaseMethod::automatic, 2)) == expected);
    }
}

TEST_CASE("boxes of very different size are found") {
    const Boxes b = random_boxes(2000, 0.02f, 100, 7);
    const std::vector<BoxPair> expected = brute_force(b);
    CHECK(sorted(found_by(b, BroadPhaseMethod::automatic, 1)) == expected);
    CHECK(sorted(found_by(b, BroadPhaseMethod::tree, 1)) == expected);
}

TEST_CASE("a crowd is found that one box far away would put into a single cell") {
    Boxes b = random_boxes(3000, 0.05f, 0, 17);
    for (float& bound : b.back().bound) bound += 1e4f;
    const std::vector<BoxPair> expected = brute_force(b);
    for (const BroadPhaseMethod method :
         {BroadPhaseMethod::automatic, BroadPhaseMethod::grid, BroadPhaseMethod::tree})
        CHECK(sorted(found_by(b, method, 1)) == expected);
}

TEST_CASE("boxes in a plane, on a line and in one place are found") {
    for (int flat = 1; flat <= 3; ++flat) {
        Boxes b = random_boxes(500, 0.05f, 0, 3);
        for (int a = 0; a < flat; ++a)
            for (Box& box : b) box.bound[a] = box.bound[3 + a] = 0.25f;
        const std::vector<BoxPair> expected = brute_force(b);
        CHECK(sorted(found_by(b, BroadPhaseMethod::grid, 1)) == expected);
        CHECK(sorted(found_by(b, BroadPhaseMethod::tree, 1)) == expected);
    }
}

TEST_CASE("the order of the pairs depends neither on threads nor on the instruction set") {
    const Boxes b = random_boxes(4000, 0.05f, 0, 11);
    for (const BroadPhaseMethod method : {BroadPhaseMethod::grid, BroadPhaseMethod::tree}) {
        const std::vector<BoxPair> pairs = found_by(b, method, 1);
        CHECK(found_by(b, method, 2) == pairs);
        CHECK(found_by(b, method, 1, InstructionSet::baseline) == pairs);
        CHECK(found_by(b, method, 1, InstructionSet::avx2) == pairs);
    }
}
