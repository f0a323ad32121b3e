// A small asset and a cached run of it on disc, for tests of what reads them.
#pragma once

#include "bake/write.h"
#include "schema/asset_view.h"
#include "schema/cache.h"
#include "schema/files/write_file.h"
#include "tests/schema/small_asset.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <string>
#include <unistd.h>

namespace keratin::test {

// An empty folder of this process and name that goes when the test ends.
struct Folder {
    std::filesystem::path path;
    explicit Folder(const std::string& name)
        : path(std::filesystem::temp_directory_path() /
               ("keratin_view_" + std::to_string(getpid()) + "_" + name)) {
        std::filesystem::remove_all(path);
        std::filesystem::create_directories(path);
    }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
};

inline void write_small_asset(const std::string& path, const SmallAsset& asset = small_asset()) {
    const auto bytes = serialise_asset(asset.info, asset.fields(), path);
    REQUIRE(bytes);
    REQUIRE(write_file(path, *bytes));
}

// Four frames: the groom carried up by 10 cm a frame and turned by 90 degrees about y from frame 1
// on.
inline void write_small_run(const std::string& asset_path, const std::string& path) {
    const auto asset = AssetView::open(asset_path);
    REQUIRE(asset);
    const AssetFields& f = asset->fields();
    const std::uint32_t strands = asset->info().strand_count, guides = asset->info().guide_count;
    CacheHead head;
    head.tool_version = "test";
    head.solver = "strand";
    head.scene = asset_path;
    head.frame = 1.0 / 30;
    head.assets = {{asset_path, asset->info().file_hash, 0, guides, 0, strands}};
    head.strand_first_point.assign(f.strand_first_point.begin(), f.strand_first_point.end());
    head.strand_radius.assign(strands, 5e-5f);
    head.guide_first_point = {0};
    std::vector<float> guide_rest;
    for (std::uint32_t g = 0; g < guides; ++g) {
        head.guide_lane.push_back(g);
        head.guide_first_point.push_back(head.guide_first_point.back() + f.guide_point_count[g]);
        for (std::uint32_t p = 0; p < f.guide_point_count[g]; ++p)
            for (std::size_t c = 0; c < 3; ++c)
                guide_rest.push_back(f.guide_position[vector_index(p, 3, c, g)]);
    }
    auto writer = CacheWriter::create(path, head);
    REQUIRE(writer);
    for (std::uint32_t i = 0; i < 4; ++i) {
        const bool turned = i > 0;
        const auto carry = [&](std::span<const float> rest) {
            std::vector<float> moved(rest.begin(), rest.end());
            for (std::size_t p = 0; p + 2 < moved.size(); p += 3) {
                if (turned) moved[p] = rest[p + 2], moved[p + 2] = -rest[p];
                moved[p + 1] += 0.1f * float(i);
            }
            return moved;
        };
        CacheFrame frame;
        frame.number = i;
        frame.time = i / 30.0;
        frame.strand_position = carry(f.strand_position);
        frame.guide_position = carry(guide_rest);
        for (std::size_t p = 0; p < f.strand_position.size() / 3; ++p) {
            frame.strand_velocity.insert(frame.strand_velocity.end(), {0, 3, 0});
            frame.strand_density.push_back(float(p % 4));
        }
        CacheBody body;
        body.motion.translation = {0, 0.1 * i, 0};
        if (turned) body.motion.rotation = {0, std::sqrt(0.5), 0, std::sqrt(0.5)};
        frame.bodies = {body};
        frame.colliders = {{CacheShape::sphere, {0, 0.1f * float(i), 0}, {}, 0.02f, {0, 0, 0, 1}}};
        REQUIRE(writer->write(frame));
    }
    REQUIRE(writer->finish());
}

}  // namespace keratin::test
