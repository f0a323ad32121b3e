#include "bake/write.h"

#include "schema/asset_view.h"
#include "schema/files/write_file.h"
#include "tests/schema/small_asset.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

using namespace keratin;
using test::SmallAsset;

namespace {

// The opener wants its bytes at a multiple of 32.
class AlignedBytes {
  public:
    explicit AlignedBytes(std::span<const std::byte> bytes)
        : blocks_(bytes.size() / sizeof(Block) + 1), size_(bytes.size()) {
        std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::byte*>(blocks_.data()));
    }
    std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(blocks_.data()), size_}; }

  private:
    struct alignas(32) Block {
        std::byte bytes[32];
    };
    std::vector<Block> blocks_;
    std::size_t size_;
};

std::vector<std::byte> written(const SmallAsset& asset) {
    auto bytes = serialise_asset(asset.info, asset.fields(), "test.kera");
    if (!bytes) FAIL(to_string(bytes.error()));
    return *bytes;
}

}  // namespace

TEST_CASE("what the writer writes the opener reads, field for field") {
    const SmallAsset asset = test::small_asset();
    AlignedBytes file(written(asset));
    const auto view = AssetView::from_memory(file.bytes(), "test.kera");
    if (!view) FAIL(to_string(view.error()));
    std::vector<std::vector<std::byte>> expected;
    for_each_field(asset.fields(), [&](const FieldDescription&, auto values) {
        const auto bytes = std::as_bytes(values);
        expected.emplace_back(bytes.begin(), bytes.end());
    });
    std::size_t i = 0;
    for_each_field(view->fields(), [&](const FieldDescription& field, auto values) {
        INFO(field.name);
        const auto bytes = std::as_bytes(values);
        CHECK(std::equal(bytes.begin(), bytes.end(), expected[i].begin(), expected[i].end()));
        CHECK(reinterpret_cast<std::uintptr_t>(values.data()) % 32 == 0);
        ++i;
    });
    CHECK(view->info().groups.at(0).name == "default");
    CHECK(view->info().groups.at(0).strand == StrandParameters{});
    CHECK(view->info().groups.at(0).material == Material{});
    CHECK(view->info().inputs.at(0).hash == Hash128{1, 2});
    CHECK(view->info().colliders.at(0).radius == 0.5f);
    CHECK(view->info().mesh_topology_hash == Hash128{3, 4});
    CHECK(view->info().file_size == file.bytes().size());
}

TEST_CASE("equal input gives equal bytes") {
    CHECK(written(test::small_asset()) == written(test::small_asset()));
}

TEST_CASE("any flipped bit of a file is refused, and never crashes the structural check") {
    const std::vector<std::byte> bytes = written(test::small_asset());
    AlignedBytes file(bytes);
    std::size_t accepted = 0, structurally_sound = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i)
        for (int bit = 0; bit < 8; ++bit) {
            file.bytes()[i] ^= std::byte(1 << bit);
            accepted += bool(AssetView::from_memory(file.bytes(), "test.kera", Verify::full));
            structurally_sound +=
                bool(AssetView::from_memory(file.bytes(), "test.kera", Verify::structure));
            file.bytes()[i] ^= std::byte(1 << bit);
        }
    CHECK(accepted == 0);
    CHECK(structurally_sound < bytes.size() * 8);
    CHECK(AssetView::from_memory(file.bytes(), "test.kera"));
}

TEST_CASE("a file cut anywhere or with bytes appended is refused") {
    const std::vector<std::byte> bytes = written(test::small_asset());
    AlignedBytes file(bytes);
    std::size_t accepted = 0;
    for (std::size_t size = 0; size < bytes.size(); ++size)
        accepted +=
            bool(AssetView::from_memory(file.bytes().first(size), "test.kera", Verify::structure));
    CHECK(accepted == 0);
    std::vector<std::byte> longer = bytes;
    longer.resize(bytes.size() + 8);
    AlignedBytes appended(longer);
    CHECK_FALSE(AssetView::from_memory(appended.bytes(), "test.kera", Verify::structure));
}

TEST_CASE("an asset of another major revision is refused with both revisions and the way out") {
    std::vector<std::byte> bytes = written(test::small_asset());
    AlignedBytes file(bytes);
    // The root table's field 0 is found the way any reader finds it.
    std::uint32_t root;
    std::memcpy(&root, file.bytes().data(), 4);
    std::int32_t to_vtable;
    std::memcpy(&to_vtable, file.bytes().data() + root, 4);
    std::uint16_t field;
    std::memcpy(&field, file.bytes().data() + root - to_vtable + 4, 2);
    const std::uint16_t other = kAssetMajor + 6;
    std::memcpy(file.bytes().data() + root + field, &other, 2);
    const auto view = AssetView::from_memory(file.bytes(), "old.kera");
    REQUIRE_FALSE(view);
    const std::string message = to_string(view.error());
    INFO(message);
    CHECK(message.find("old.kera") == 0);
    CHECK(message.find("revision " + std::to_string(other)) != std::string::npos);
    CHECK(message.find("revision " + std::to_string(kAssetMajor)) != std::string::npos);
    CHECK(message.find("keratin-bake") != std::string::npos);
}

TEST_CASE("the writer refuses what the opener would refuse, and names field and element") {
    const auto message_of = [](auto&& damage) {
        SmallAsset asset = test::small_asset();
        damage(asset);
        const auto bytes = serialise_asset(asset.info, asset.fields(), "head.kera");
        REQUIRE_FALSE(bytes);
        return to_string(bytes.error());
    };
    const auto names = [](const std::string& message, const std::string& part) {
        INFO(message);
        CHECK(message.find("head.kera: ") == 0);
        CHECK(message.find(part) != std::string::npos);
    };
    names(message_of([](SmallAsset& a) { a.strand_guide[4] = 64; }), "strand_guide[4] is 64");
    names(message_of([](SmallAsset& a) { a.strand_guide[4] = 20; }), "an empty lane");
    names(message_of(
              [](SmallAsset& a) { a.guide_position[7] = std::numeric_limits<float>::quiet_NaN(); }),
          "guide_position[7] is nan");
    names(message_of([](SmallAsset& a) { a.strand_weight[3] = 0.75f; }), "sum to");
    names(message_of([](SmallAsset& a) { a.strand_triangle[2] = 1; }), "strand_triangle[2] is 1");
    names(message_of([](SmallAsset& a) { a.strand_barycentric[1] = 1.5f; }),
          "outside its triangle");
    names(message_of([](SmallAsset& a) { a.mesh_triangle[0] = 3; }), "mesh_triangle[0] is 3");
    names(message_of([](SmallAsset& a) { a.strand_first_point[2] = 3; }), "strand_first_point[2]");
    names(message_of([](SmallAsset& a) { a.guide_length[scalar_index(1, 2)] = 0; }),
          "guide_length[18]");
    names(message_of([](SmallAsset& a) { a.guide_point_count[3] = 5; }),
          "guide_point_count[3] is 5");
    names(message_of([](SmallAsset& a) { a.tile_first_row[1] = 3; }), "tile");
    names(message_of([](SmallAsset& a) { a.guide_group[17] = 1; }), "guide_group[17]");
    names(message_of([](SmallAsset& a) { a.strand_id.pop_back(); }),
          "strand_id has 6 elements instead of 7");
    names(message_of([](SmallAsset& a) { a.info.groups[0].material.radius = 0; }), "radius is 0");
    names(message_of([](SmallAsset& a) {
              a.info.groups[0].strand.damping = {0.5f, 2};
          }),
          "damping is 2");
    names(message_of([](SmallAsset& a) {
              a.info.attach = Attach::triangle;
              a.guide_triangle.clear();
              a.guide_barycentric.clear();
              a.strand_triangle.clear();
              a.strand_barycentric.clear();
          }),
          "attach is triangle");
    names(message_of([](SmallAsset& a) { a.info.colliders[0].bone = 2; }),
          "colliders[0].bone is 2");
    names(message_of([](SmallAsset& a) { a.info.levels = {{7, 1}}; }), "levels[0] has 7 strands");
    names(message_of([](SmallAsset& a) {
              a.info.levels = {{4, 2}, {2, 1.5f}};
          }),
          "levels[1] scales widths by 1.5");
    const auto strained = [&](std::size_t at, float value) {
        SmallAsset a = test::small_asset();
        std::vector<float> strain(4 * a.guide_length.size(), 0);
        strain[at] = value;
        AssetFields fields = a.fields();
        fields.guide_rod_strain = strain;
        const auto bytes = serialise_asset(a.info, fields, "head.kera");
        return bytes ? "" : to_string(bytes.error());
    };
    const auto component = [](std::size_t c) { return vector_index(5, 4, c, 3); };
    CHECK(strained(component(3), 29) == "");
    names(strained(component(1), std::numeric_limits<float>::infinity()), "guide_rod_strain[339]");
    names(strained(component(0), -0.75f),
          "guide_rod_strain[323] is a stretch of -0.75; it must be in [-0.5, 0.5]");
    names(strained(component(2), 9), "is a bend of 9; it must be in [-8, 8]");
    names(strained(component(3), -31), "is a twist of -31");
    names(message_of([](SmallAsset& a) { a.info.guide_error = {"kmeans", -1, 0, 0}; }),
          "guide_error holds -1");
}

TEST_CASE("packed positions come back within their error, and packing them again changes nothing") {
    SmallAsset asset = test::small_asset();
    for (std::size_t i = 0; i < asset.strand_position.size(); ++i)
        asset.strand_position[i] += 1e-3f * std::sin(float(i)) + 1.5f;
    asset.info.packed = true;
    asset.info.packed_max_error = 1e-6f;
    AlignedBytes file(written(asset));
    const auto view = AssetView::from_memory(file.bytes(), "test.kera");
    if (!view) FAIL(to_string(view.error()));
    CHECK(view->info().packed);
    CHECK(view->info().packed_max_error == 1e-6f);
    const auto position = view->fields().strand_position;
    REQUIRE(position.size() == asset.strand_position.size());
    const float extent = *std::max_element(asset.strand_position.begin(), asset.strand_position.end()) -
                         *std::min_element(asset.strand_position.begin(), asset.strand_position.end());
    float error = 0;
    for (std::size_t i = 0; i < position.size(); ++i)
        error = std::max(error, std::abs(position[i] - asset.strand_position[i]));
    CHECK(error > 0);
    CHECK(error < extent / 32767);  // half of a step of at most two 32767ths
    // The numbers of each strand's root are exact.
    for (std::size_t s = 0; s + 1 < asset.strand_first_point.size(); ++s)
        for (std::size_t c = 0; c < 3; ++c)
            CHECK(position[3 * asset.strand_first_point[s] + c] ==
                  asset.strand_position[3 * asset.strand_first_point[s] + c]);
    asset.strand_position.assign(position.begin(), position.end());
    const std::vector<std::byte> again = written(asset);
    CHECK(std::equal(again.begin(), again.end(), file.bytes().begin(), file.bytes().end()));
}

TEST_CASE("widths grow so that a prefix covers what all strands cover") {
    CHECK(width_scale({}, 100, 25) == Approx(4));
    CHECK(width_scale({}, 100, 100) == 1);
    CHECK(width_scale({}, 100, 0) == 1);
    // The first half covers two fifths, the first tenth a twentieth.
    const std::vector<LevelOfDetail> levels{{50, 2.5f}, {10, 20}};
    CHECK(width_scale(levels, 100, 50) == Approx(2.5));
    CHECK(width_scale(levels, 100, 10) == Approx(20));
    CHECK(width_scale(levels, 100, 30) == Approx(1 / (0.05 + 0.35 / 2)));
    CHECK(width_scale(levels, 100, 75) == Approx(1 / 0.7));
    CHECK(width_scale(levels, 100, 5) == Approx(40));
}

TEST_CASE("a failed write leaves the old file as it was") {
    const std::string path = "write_test_target.txt";
    REQUIRE(write_file(path, "old"));
    {
        auto pending = PendingFile::create(path);
        REQUIRE(pending);
        REQUIRE(pending->write("half of something new"));
    }
    const auto bytes = read_file(path);
    REQUIRE(bytes);
    CHECK(std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) == "old");
    std::remove(path.c_str());
    CHECK_FALSE(write_file("no_such_folder/file.txt", "text"));
}

TEST_CASE("a missing, an empty and a foreign file each get a message of their own") {
    const auto message = [](const std::string& path) {
        const auto view = AssetView::open(path);
        REQUIRE_FALSE(view);
        return to_string(view.error());
    };
    CHECK(message("missing.kera").find("missing.kera: cannot open") == 0);
    { std::ofstream("empty.kera"); }
    CHECK(message("empty.kera").find("empty") != std::string::npos);
    REQUIRE(write_file("foreign.kera", "GIF89a, certainly not an asset"));
    CHECK(message("foreign.kera").find("not a keratin asset") != std::string::npos);
    CHECK(message(".").find("regular file") != std::string::npos);
    std::remove("empty.kera");
    std::remove("foreign.kera");
}
