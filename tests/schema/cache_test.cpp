#include "schema/cache.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <unistd.h>

using namespace keratin;
namespace fs = std::filesystem;

namespace {

CacheHead small_head() {
    CacheHead head;
    head.tool_version = "0.1.0";
    head.solver = "strand";
    head.scene = "scene.json";
    head.frame = 1.0 / 60;
    head.assets = {{"head.kera", {1, 2}, 0, 1, 0, 2}};
    head.guide_first_point = {0, 2};
    head.guide_lane = {5};
    head.strand_first_point = {0, 2, 5};
    head.strand_radius = {1e-4f, 2e-4f};
    return head;
}

CacheFrame small_frame(std::uint32_t number) {
    CacheFrame frame;
    frame.number = number;
    frame.time = number / 60.0;
    const float k = static_cast<float>(number);
    frame.guide_position = {k, 1, 2, 3, 4, 5};
    frame.strand_position = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, k};
    frame.bodies.resize(1);
    frame.bodies[0].motion = {{1, 2, k}, {0, 1, 0, 0}};
    frame.bodies[0].bones = {{{3, 4, 5}, {0, 0, 1, 0}}};
    frame.bodies[0].mesh_position = {1, 2, 3};
    frame.colliders = {{CacheShape::capsule, {1, 2, 3}, {4, 5, 6}, 0.5f, {0, 0, 1, 0}}};
    return frame;
}

struct Folder {
    fs::path path =
        fs::temp_directory_path() / ("keratin_cache_test_" + std::to_string(::getpid()));
    Folder() {
        fs::remove_all(path);
        fs::create_directories(path);
    }
    ~Folder() { fs::remove_all(path); }
    std::string file(const char* name) const { return (path / name).string(); }
};

void write_small(const std::string& path) {
    auto writer = CacheWriter::create(path, small_head());
    REQUIRE(writer);
    for (std::uint32_t i = 0; i < 3; ++i) REQUIRE(writer->write(small_frame(i)));
    REQUIRE(writer->finish());
}

std::string read_bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Whether the file opens and all its frames can be read.
bool reads(const std::string& path) {
    auto reader = CacheReader::open(path);
    if (!reader) return false;
    for (std::size_t i = 0; i < reader->frame_count(); ++i)
        if (!reader->frame(i)) return false;
    return true;
}

}  // namespace

TEST_CASE("a cache gives back what was written, frame by frame") {
    const Folder folder;
    write_small(folder.file("run.kcache"));
    auto reader = CacheReader::open(folder.file("run.kcache"));
    REQUIRE(reader);
    const CacheHead& head = reader->head();
    CHECK(head.tool_version == "0.1.0");
    CHECK(head.solver == "strand");
    CHECK(head.scene == "scene.json");
    CHECK(head.frame == 1.0 / 60);
    REQUIRE(head.assets.size() == 1);
    CHECK(head.assets[0].file == "head.kera");
    CHECK(head.assets[0].hash == Hash128{1, 2});
    CHECK(head.assets[0].guide_count == 1);
    CHECK(head.assets[0].strand_count == 2);
    CHECK(head.guide_lane == std::vector<std::uint32_t>{5});
    CHECK(head.strand_first_point == std::vector<std::uint32_t>{0, 2, 5});
    CHECK(head.strand_radius == std::vector<float>{1e-4f, 2e-4f});
    REQUIRE(reader->frame_count() == 3);
    auto frame = reader->frame(2);
    REQUIRE(frame);
    const CacheFrame wanted = small_frame(2);
    CHECK(frame->number == 2);
    CHECK(frame->time == wanted.time);
    CHECK(frame->guide_position == wanted.guide_position);
    CHECK(frame->strand_position == wanted.strand_position);
    CHECK(frame->strand_velocity.empty());
    CHECK(frame->strand_density.empty());
    REQUIRE(frame->bodies.size() == 1);
    CHECK(frame->bodies[0].motion.translation == wanted.bodies[0].motion.translation);
    CHECK(frame->bodies[0].motion.rotation == wanted.bodies[0].motion.rotation);
    CHECK(frame->bodies[0].bones[0].translation == wanted.bodies[0].bones[0].translation);
    CHECK(frame->bodies[0].mesh_position == wanted.bodies[0].mesh_position);
    REQUIRE(frame->colliders.size() == 1);
    CHECK(frame->colliders[0].shape == CacheShape::capsule);
    CHECK(frame->colliders[0].b == std::array<float, 3>{4, 5, 6});
    CHECK(frame->colliders[0].radius == 0.5f);
    CHECK(frame->colliders[0].rotation == std::array<float, 4>{0, 0, 1, 0});
}

TEST_CASE("a frame that does not fit the head of its cache is refused") {
    const Folder folder;
    auto writer = CacheWriter::create(folder.file("run.kcache"), small_head());
    REQUIRE(writer);
    CacheFrame frame = small_frame(0);
    frame.strand_position.pop_back();
    CHECK_FALSE(writer->write(frame));
    frame = small_frame(0);
    frame.strand_velocity = {1, 2, 3};
    CHECK_FALSE(writer->write(frame));
    CacheHead head = small_head();
    head.strand_first_point = {0, 5, 2};
    CHECK_FALSE(CacheWriter::create(folder.file("other.kcache"), head));
}

TEST_CASE("a cache that was not finished leaves nothing behind and keeps the old file") {
    const Folder folder;
    write_small(folder.file("run.kcache"));
    const std::string before = read_bytes(folder.file("run.kcache"));
    {
        auto writer = CacheWriter::create(folder.file("run.kcache"), small_head());
        REQUIRE(writer);
        REQUIRE(writer->write(small_frame(0)));
    }
    CHECK(read_bytes(folder.file("run.kcache")) == before);
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);
}

TEST_CASE("a cache cut anywhere, or with any bit of its content changed, is refused") {
    const Folder folder;
    const std::string path = folder.file("run.kcache");
    write_small(path);
    const std::string good = read_bytes(path);
    const auto store = [&](const std::string& bytes) {
        std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    };
    REQUIRE(reads(path));
    for (std::size_t n = 0; n < good.size(); n += 7) {
        store(good.substr(0, n));
        INFO(n);
        CHECK_FALSE(reads(path));
    }
    store(good + std::string(32, '\0'));
    CHECK_FALSE(reads(path));
    // Padding and bytes kept for later are the only ones a reader does not need.
    std::size_t unnoticed = 0;
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ (1 << (i % 8)));
        store(bad);
        unnoticed += reads(path);
    }
    CHECK(unnoticed < 32 * 8);
}

TEST_CASE("a cache of another revision is refused with both revisions and what to do") {
    const Folder folder;
    const std::string path = folder.file("run.kcache");
    write_small(path);
    std::string bytes = read_bytes(path);
    bytes[8] = 9;
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    auto reader = CacheReader::open(path);
    REQUIRE_FALSE(reader);
    CHECK(reader.error().message.find("revision 9, this program reads revision 1") !=
          std::string::npos);
    std::ofstream(path, std::ios::trunc) << "something else";
    CHECK(CacheReader::open(path).error().message.find("not a cached run") == 0);
}
