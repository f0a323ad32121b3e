#include "runtime/simulation.h"
#include "tests/data_dir.h"
#include "tests/revision/recorded.h"
#include "tests/tools/diff/full_asset.h"
#include "tools/keratin-diff/compare.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <set>

using namespace keratin;
namespace fs = std::filesystem;

namespace {

// Revisions of `schema` for which `folder` holds a file, "1.0" and so on.
std::set<std::string> revisions(const char* folder, const std::string& schema,
                                const std::string& extension) {
    std::set<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string stem = entry.path().stem().string();
        if (entry.path().extension() == extension && stem.starts_with(schema + "-"))
            found.insert(stem.substr(schema.size() + 1));
    }
    return found;
}

constexpr const char* kHistory = KERATIN_DATA_DIR "/../schema/history";
constexpr const char* kFiles = KERATIN_DATA_DIR "/revision";

std::string recorded(const std::string& name) { return std::string(kFiles) + "/" + name; }

}  // namespace

TEST_CASE("there is a file of every released revision") {
    CHECK_FALSE(revisions(kHistory, "asset", ".fbs").empty());
    CHECK(revisions(kHistory, "asset", ".fbs") == revisions(kFiles, "asset", ".kera"));
    CHECK(revisions(kHistory, "cache", ".fbs") == revisions(kFiles, "cache", ".kcache"));
}

TEST_CASE("an asset of every released revision means what it meant") {
    const test::OpenAsset expected(test::full_asset());
    for (const std::string& revision : revisions(kFiles, "asset", ".kera")) {
        INFO(revision);
        const auto asset = AssetView::open(recorded("asset-" + revision + ".kera"));
        if (!asset) FAIL(to_string(asset.error()));
        const AssetInfo& info = asset->info();
        CHECK(std::to_string(info.format_major) + "." + std::to_string(info.format_minor) ==
              revision);
        const diff::Report report = diff::compare(*asset, expected.view());
        CHECK(report.strands.matched == 7);
        CHECK(report.guides.matched == 5);
        for (const diff::FieldDifference& field : report.fields) {
            INFO(field.name);
            // Fields that were added later are all that may be missing.
            CHECK(field.differing == 0);
            CHECK_FALSE(field.only_in_a);
        }
        CHECK(report.settings.empty());
        CHECK(report.mesh.empty());
        CHECK(report.inputs.empty());
    }
}

TEST_CASE("an asset of every released revision can be simulated") {
    for (const std::string& revision : revisions(kFiles, "asset", ".kera")) {
        INFO(revision);
        const auto asset = AssetView::open(recorded("asset-" + revision + ".kera"));
        REQUIRE(asset);
        auto simulation = Simulation::create(*asset, Settings());
        if (!simulation) FAIL(to_string(simulation.error()));
        for (int i = 0; i < 3; ++i) REQUIRE(simulation->step(1.0 / 60));
        CHECK(simulation->strands().strand_count == 7);
        for (const float x : simulation->strands().position) REQUIRE(std::isfinite(x));
    }
}

TEST_CASE("a cached run of every released revision holds what was written") {
    for (const std::string& revision : revisions(kFiles, "cache", ".kcache")) {
        INFO(revision);
        const auto cache = CacheReader::open(recorded("cache-" + revision + ".kcache"));
        if (!cache) FAIL(to_string(cache.error()));
        CHECK(cache->head().strand_first_point == test::recorded_head().strand_first_point);
        CHECK(cache->head().strand_radius == test::recorded_head().strand_radius);
        REQUIRE(cache->frame_count() == test::kRecordedFrames);
        for (std::uint32_t i = 0; i < test::kRecordedFrames; ++i) {
            const auto frame = cache->frame(i);
            if (!frame) FAIL(to_string(frame.error()));
            CHECK(frame->time == test::recorded_frame(i).time);
            CHECK(frame->strand_position == test::recorded_frame(i).strand_position);
            CHECK(frame->strand_velocity == test::recorded_frame(i).strand_velocity);
            CHECK(frame->colliders.at(0).radius == 0.1f);
        }
    }
}
