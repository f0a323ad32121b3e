// How long a comparison of two large assets takes, opening and verifying them included.
#include "bake/write.h"
#include "schema/files/write_file.h"
#include "tests/tools/diff/full_asset.h"
#include "tools/keratin-diff/compare.h"

#include <catch2/catch.hpp>

#include <cstdio>
#include <ctime>
#include <random>

using namespace keratin;
using test::FullAsset;

namespace {

constexpr std::uint32_t kStrands = 100000, kPoints = 16, kGuides = 10048;
// s of CPU time; measured 0.15 and, where all strands are looked for by their shape, 0.7.
constexpr double kLimit = 1, kLimitWithoutIds = 3;

// A patch of curls; every tenth strand or so is a guide.
FullAsset large_asset() {
    FullAsset a;
    a.info.tool_version = "test";
    a.info.groups.push_back({"default", {}, {}});
    a.info.tile_count = kGuides / kTileLanes;
    a.info.row_count = a.info.tile_count * kPoints;
    a.info.guide_count = kGuides;
    a.info.strand_count = kStrands;
    a.info.point_count = kStrands * kPoints;
    a.info.bounds_max = {0.4f, 0.2f, 0.4f};
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    for (std::uint32_t s = 0; s < kStrands; ++s) {
        a.strand_first_point.push_back(s * kPoints);
        const float x = 0.4f * unit(random), z = 0.4f * unit(random), phase = 6 * unit(random);
        for (std::uint32_t p = 0; p < kPoints; ++p)
            a.strand_position.insert(a.strand_position.end(),
                                     {x + 0.01f * std::sin(phase + 0.5f * float(p)),
                                      0.01f * float(p), z + 0.01f * std::cos(phase)});
        a.strand_guide.insert(a.strand_guide.end(),
                              {s % kGuides, (s + 1) % kGuides, (s + 2) % kGuides});
        a.strand_weight.insert(a.strand_weight.end(), {0.5f, 0.25f, 0.25f});
        a.strand_id.push_back(s);
        a.strand_group.push_back(0);
        a.strand_uv.insert(a.strand_uv.end(), {x, z});
    }
    a.strand_first_point.push_back(kStrands * kPoints);
    a.guide_position.resize(std::size_t{3} * a.info.row_count * kTileLanes);
    a.guide_length.resize(a.info.row_count * kTileLanes);
    a.guide_shape.resize(a.guide_position.size());
    for (std::uint32_t guide = 0; guide < kGuides; ++guide) {
        const std::size_t tile = guide / kTileLanes, lane = guide % kTileLanes;
        a.guide_point_count.push_back(kPoints);
        a.guide_strand.push_back(guide);
        a.guide_group.push_back(0);
        for (std::uint32_t p = 0; p < kPoints; ++p) {
            const std::size_t row = tile * kPoints + p;
            for (std::size_t axis = 0; axis < 3; ++axis)
                a.guide_position[vector_index(row, 3, axis, lane)] =
                    a.strand_position[3 * (guide * kPoints + p) + axis];
            a.guide_length[scalar_index(row, lane)] = p > 0 ? 0.01f : 0.0f;
        }
    }
    for (std::uint32_t t = 0; t <= a.info.tile_count; ++t) a.tile_first_row.push_back(t * kPoints);
    return a;
}

void write(const std::string& path, const FullAsset& asset) {
    const auto bytes = serialise_asset(asset.info, asset.fields(), path);
    if (!bytes) FAIL(to_string(bytes.error()));
    REQUIRE(write_file(path, *bytes));
}

// s of CPU time.
double time_comparison(const std::string& name, std::size_t differing) {
    const std::clock_t start = std::clock();
    const auto a = AssetView::open("large_a.kera"), b = AssetView::open("large_b.kera");
    REQUIRE(a);
    REQUIRE(b);
    const diff::Report report = diff::compare(*a, *b);
    const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
    std::printf("%s: %.3f s of CPU time\n", name.c_str(), seconds);
    for (const auto& field : report.fields)
        if (field.name == "strand_position") CHECK(field.differing == differing);
    return seconds;
}

}  // namespace

TEST_CASE("two assets of 100 000 strands are compared within a second") {
    FullAsset asset = large_asset();
    write("large_a.kera", asset);
    asset.strand_position[3 * 77777] += 1e-3f;
    write("large_b.kera", asset);
    CHECK(time_comparison("100 000 strands, one point moved", 1) < kLimit);
    for (float& x : asset.strand_position) x += 1e-4f;
    for (float& x : asset.strand_weight) x = 1.0f / 3;
    write("large_b.kera", asset);
    CHECK(time_comparison("100 000 strands, every point and weight changed",
                          std::size_t{kStrands} * kPoints) < kLimit);
    // No id means anything: every strand is looked for by its root and shape.
    asset.strand_id.assign(kStrands, 0);
    write("large_b.kera", asset);
    FullAsset without_ids = large_asset();
    without_ids.strand_id.assign(kStrands, 0);
    write("large_a.kera", without_ids);
    CHECK(time_comparison("100 000 strands moved, without ids", std::size_t{kStrands} * kPoints) <
          kLimitWithoutIds);
    std::remove("large_a.kera");
    std::remove("large_b.kera");
}
