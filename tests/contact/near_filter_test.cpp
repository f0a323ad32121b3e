#include "runtime/contact/near_filter.h"

#include "runtime/contact/meeting.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace keratin;

namespace {

// Edges of 5 mm and 0.05 mm radius in a cube, each end on its way by up to `move` (m).
struct Edges {
    std::vector<MovingSegment> exact;
    std::vector<FilterEdge> filter;
    std::vector<BoxPair> pairs;  // all of them
};

constexpr double kRadius = 5e-5;

FilterEdge filter_edge(const MovingSegment& e, std::uint32_t strand, double radius = kRadius) {
    FilterEdge f{};
    const Vector3 parts[4] = {e.a, e.b, e.move_a, e.move_b};
    for (int k = 0; k < 4; ++k) {
        f.value[3 * k] = static_cast<float>(parts[k].x);
        f.value[3 * k + 1] = static_cast<float>(parts[k].y);
        f.value[3 * k + 2] = static_cast<float>(parts[k].z);
    }
    f.half_distance = static_cast<float>(radius);
    for (const float v : f.value) f.error = std::max(f.error, 6e-7f * std::fabs(v));
    f.strand = strand;
    return f;
}

Edges random_edges(std::uint32_t count, double move, bool parallel) {
    std::mt19937 random(static_cast<unsigned>(count) + parallel);
    std::uniform_real_distribution<double> unit(-1, 1);
    auto any = [&] { return Vector3(unit(random), unit(random), unit(random)); };
    Edges out;
    const Vector3 common = any();
    for (std::uint32_t i = 0; i < count; ++i) {
        Vector3 along = parallel ? common + 1e-4 * any() : any();
        along *= 5e-3 / length(along);
        const Vector3 a = (parallel ? 4e-3 : 8e-3) * any();
        out.exact.push_back({a, a + along, move * any(), move * any()});
        out.filter.push_back(filter_edge(out.exact.back(), i));
        for (std::uint32_t j = 0; j < i; ++j) out.pairs.push_back({j, i});
    }
    return out;
}

}  // namespace

TEST_CASE("no pair of edges that meet is thrown out, and few others are kept") {
    for (const bool parallel : {false, true})
        for (const double move : {0.0, 1e-5, 1e-3, 1e-2}) {
            const Edges edges = random_edges(300, move, parallel);
            std::vector<BoxPair> kept, meeting;
            keep_near_pairs(edges.filter, edges.pairs, kept);
            for (const BoxPair& p : edges.pairs)
                if (first_segment_contact(edges.exact[p.first], edges.exact[p.second], 2 * kRadius)
                        .found)
                    meeting.push_back(p);
            INFO("motion " << move << " m, parallel " << parallel << ": " << kept.size()
                           << " kept, " << meeting.size() << " meet, of " << edges.pairs.size());
            REQUIRE(meeting.size() > 10);
            std::size_t at = 0;
            for (const BoxPair& p : meeting) {
                while (at < kept.size() && kept[at] != p) ++at;
                CHECK(at < kept.size());
            }
            CHECK(kept.size() < 2 * meeting.size());
        }
}

TEST_CASE("the same pairs are kept on every instruction set") {
    const Edges edges = random_edges(200, 1e-3, false);
    std::vector<BoxPair> automatic;
    keep_near_pairs(edges.filter, edges.pairs, automatic);
    for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2}) {
        std::vector<BoxPair> kept;
        keep_near_pairs(edges.filter, edges.pairs, kept, set);
        CHECK(kept == automatic);
    }
}

TEST_CASE("long edges that cross at a small angle and only just touch are kept") {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    auto any = [&] { return Vector3(unit(random), unit(random), unit(random)); };
    std::vector<FilterEdge> edges;
    std::vector<BoxPair> pairs, kept;
    constexpr std::uint32_t kPairs = 20'000;
    constexpr double kThin = 1.5e-5;
    for (std::uint32_t i = 0; i < kPairs; ++i) {
        // Through two points a contact distance apart, across the way between them.
        Vector3 along = any();
        along *= 1 / length(along);
        const Vector3 side = any_perpendicular(along), out = cross(along, side);
        const double sine = std::pow(10.0, -2.5 + unit(random));
        const Vector3 other = along + sine * side;
        const Vector3 place = 5e-3 * any(), away = 2 * kThin * (1 - 1e-4) * out;
        const auto edge = [&](const Vector3& through, const Vector3& way) {
            const double before = 0.025 * (1 + unit(random)), after = 0.025 * (1 + unit(random));
            return MovingSegment{through - before * way, through + after * way, Vector3(0),
                                 Vector3(0)};
        };
        edges.push_back(filter_edge(edge(place, along), 2 * i, kThin));
        edges.push_back(filter_edge(edge(place + away, other), 2 * i + 1, kThin));
        pairs.push_back({2 * i, 2 * i + 1});
    }
    keep_near_pairs(edges, pairs, kept);
    CHECK(kept.size() == kPairs);
}
