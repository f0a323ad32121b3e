#include "runtime/export/strand_export.h"
#include "schema/files/write_file.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <cstring>
#include <map>

using namespace keratin;

namespace {

// Walks the tree of an Ogawa file by its layout alone: enough to list every property of every
// object with its samples. Independent of the writer, and first tried on a file that Alembic's own
// library wrote.
class Walker {
  public:
    explicit Walker(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

    struct Property {
        std::uint32_t kind, pod, extent, sample_count, time_sampling;
        std::vector<std::vector<std::byte>> samples;  // stored ones, without their keys
    };
    std::map<std::string, Property> properties;   // by path: "/strands/.geom/P"
    std::map<std::string, std::string> metadata;  // of objects and compounds

    void walk() {
        REQUIRE(std::memcmp(bytes_.data(), "Ogawa\xff\0\1", 8) == 0);
        const auto root = group(read<std::uint64_t>(8));
        REQUIRE(root.size() == 6);
        const auto indexed = data(root[5]);
        for (std::size_t i = 0; i < indexed.size();) {
            const auto size = static_cast<std::size_t>(indexed[i]);
            metadata_.emplace_back(reinterpret_cast<const char*>(&indexed[i + 1]), size);
            i += 1 + size;
        }
        object(root[2], "");
    }

  private:
    template <class T>
    T read(std::uint64_t at) const {
        REQUIRE(at + sizeof(T) <= bytes_.size());
        T value;
        std::memcpy(&value, bytes_.data() + at, sizeof value);
        return value;
    }
    std::vector<std::uint64_t> group(std::uint64_t at) const {
        if (at == 0) return {};
        REQUIRE((at >> 63) == 0);
        std::vector<std::uint64_t> children(read<std::uint64_t>(at));
        for (std::size_t i = 0; i < children.size(); ++i)
            children[i] = read<std::uint64_t>(at + 8 + 8 * i);
        return children;
    }
    std::vector<std::byte> data(std::uint64_t at) const {
        REQUIRE((at >> 63) == 1);
        at &= ~(1ull << 63);
        if (at == 0) return {};
        const auto size = read<std::uint64_t>(at);
        REQUIRE(at + 8 + size <= bytes_.size());
        const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(at + 8);
        return {begin, begin + static_cast<std::ptrdiff_t>(size)};
    }
    static std::uint32_t take(const std::vector<std::byte>& bytes, std::size_t& at,
                              std::size_t size) {
        REQUIRE(at + size <= bytes.size());
        std::uint32_t value = 0;
        std::memcpy(&value, bytes.data() + at, size);
        at += size;
        return value;
    }
    static std::string take_text(const std::vector<std::byte>& bytes, std::size_t& at,
                                 std::size_t size) {
        REQUIRE(at + size <= bytes.size());
        std::string text(reinterpret_cast<const char*>(bytes.data()) + at, size);
        at += size;
        return text;
    }
    const std::string metadata_of(std::uint32_t index) const {
        return index == 0 ? "" : metadata_.at(index - 1);
    }

    void object(std::uint64_t at, const std::string& path) {
        const auto children = group(at);
        REQUIRE(children.size() >= 2);
        compound(children.front(), path);
        const auto headers = data(children.back());
        std::size_t i = 0;
        for (std::size_t c = 1; c + 1 < children.size(); ++c) {
            const std::string name = path + "/" + take_text(headers, i, take(headers, i, 4));
            metadata[name] = metadata_of(take(headers, i, 1));
            object(children[c], name);
        }
        CHECK(headers.size() - i == 32);
    }

    void compound(std::uint64_t at, const std::string& path) {
        const auto children = group(at);
        if (children.empty()) return;
        const auto headers = data(children.back());
        std::size_t i = 0;
        for (std::size_t c = 0; c + 1 < children.size(); ++c) {
            const std::uint32_t info = take(headers, i, 4), size = 1u << (info >> 2 & 3);
            Property property{info & 3, info >> 4 & 15, info >> 12 & 255, 0, 0, {}};
            if (property.kind != 0) {
                property.sample_count = take(headers, i, size);
                if (info & 0x200) i += 2 * size;
                if (info & 0x100) property.time_sampling = take(headers, i, size);
            }
            const std::string name = path + "/" + take_text(headers, i, take(headers, i, size));
            if (property.kind == 0) {
                metadata[name] = metadata_of(info >> 20 & 255);
                compound(children[c], name);
                continue;
            }
            const auto blocks = group(children[c]);
            for (std::size_t b = 0; b < blocks.size(); b += property.kind == 2 ? 2 : 1) {
                auto sample = data(blocks[b]);
                if (!sample.empty()) sample.erase(sample.begin(), sample.begin() + 16);
                property.samples.push_back(std::move(sample));
            }
            properties[name] = std::move(property);
        }
        CHECK(i == headers.size());
    }

    std::vector<std::byte> bytes_;
    std::vector<std::string> metadata_;
};

Walker walked(const std::string& path) {
    auto bytes = read_file(path);
    if (!bytes) FAIL(to_string(bytes.error()));
    Walker walker(std::move(*bytes));
    walker.walk();
    return walker;
}

template <class T>
std::vector<T> values(const std::vector<std::byte>& sample) {
    std::vector<T> out(sample.size() / sizeof(T));
    std::memcpy(out.data(), sample.data(), out.size() * sizeof(T));
    return out;
}

const ExportStrands kTwoStrands{{0, 3, 5}, {1e-3f, 2e-3f}, {0, 0.25f, 0.5f, 1}, {7, 9}, {1, 0}};
const std::vector<float> kPositions{0, 0, 0, 0, 1, 0, 0, 2, 0, 1, 0, 0, 1, 1, 0.5f};

}  // namespace

TEST_CASE("the walker reads a file of Alembic's own library") {
    const Walker file = walked(KERATIN_DATA_DIR "/alembic_malformed/curves1.abc");
    const std::string geometry = "/really_long_curves_name/.geom";
    CHECK(file.metadata.at(geometry) ==
          "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1");
    CHECK(file.properties.at(geometry + "/P").sample_count == 5);
    CHECK(values<std::int32_t>(file.properties.at(geometry + "/nVertices").samples.at(0)) ==
          std::vector<std::int32_t>{8, 4});
    CHECK(values<std::uint8_t>(file.properties.at(geometry + "/curveBasisAndType").samples.at(0)) ==
          std::vector<std::uint8_t>{0, 0, 1, 1});
}

TEST_CASE("exported Alembic curves hold every frame, the counts and the groom attributes") {
    const std::string path = "alembic_test.abc";
    auto exporter = StrandExporter::create(path, kTwoStrands, 0.02, 2);
    REQUIRE(exporter);
    std::vector<float> moved = kPositions;
    for (float& x : moved) x += 1;
    REQUIRE((*exporter)->add(kPositions));
    REQUIRE((*exporter)->add(moved));
    REQUIRE((*exporter)->finish());
    const Walker file = walked(path);
    std::remove(path.c_str());

    CHECK(file.metadata.at("/strands").find("schema=AbcGeom_Curve_v2") == 0);
    CHECK(file.metadata.at("/strands/.geom") ==
          "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1");
    const auto& position = file.properties.at("/strands/.geom/P");
    CHECK(position.pod == 10);
    CHECK(position.extent == 3);
    CHECK(position.time_sampling == 1);
    REQUIRE(position.samples.size() == 2);
    CHECK(values<float>(position.samples[0]) == kPositions);
    CHECK(values<float>(position.samples[1]) == moved);
    CHECK(values<std::int32_t>(file.properties.at("/strands/.geom/nVertices").samples.at(0)) ==
          std::vector<std::int32_t>{3, 2});
    CHECK(values<std::uint8_t>(
              file.properties.at("/strands/.geom/curveBasisAndType").samples.at(0)) ==
          std::vector<std::uint8_t>{1, 0, 0, 0});
    CHECK(values<float>(file.properties.at("/strands/.geom/width").samples.at(0)) ==
          std::vector<float>{2e-3f, 4e-3f});
    CHECK(values<double>(file.properties.at("/strands/.geom/.selfBnds").samples.at(0)) ==
          std::vector<double>{0, 0, 0, 1, 2, 0.5});
    const std::string attributes = "/strands/.geom/.arbGeomParams/";
    CHECK(values<std::int32_t>(file.properties.at(attributes + "groom_id").samples.at(0)) ==
          std::vector<std::int32_t>{7, 9});
    CHECK(values<float>(file.properties.at(attributes + "groom_root_uv").samples.at(0)) ==
          std::vector<float>{0, 0.25f, 0.5f, 1});
    CHECK(values<std::uint8_t>(file.properties.at(attributes + "groom_guide").samples.at(0)) ==
          std::vector<std::uint8_t>{1, 0});
}

TEST_CASE("an Alembic export that is not finished leaves no file") {
    {
        auto exporter = StrandExporter::create("unfinished.abc", kTwoStrands, 0.02, 2);
        REQUIRE(exporter);
        REQUIRE((*exporter)->add(kPositions));
    }
    CHECK_FALSE(read_file("unfinished.abc"));
}

TEST_CASE("exported .hair and .obj files hold the same points, one file a frame") {
    for (const std::string ending : {".hair", ".obj"}) {
        auto exporter = StrandExporter::create("export_test" + ending, kTwoStrands, 0.02, 2);
        REQUIRE(exporter);
        REQUIRE((*exporter)->add(kPositions));
        REQUIRE((*exporter)->add(kPositions));
        REQUIRE((*exporter)->finish());
        for (const std::string number : {".0000", ".0001"}) {
            const std::string path = "export_test" + number + ending;
            const auto bytes = read_file(path);
            REQUIRE(bytes);
            std::remove(path.c_str());
            const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
            if (ending == ".obj") {
                CHECK(text.find("v 1 1 0.5\n") != std::string::npos);
                CHECK(text.find("l 1 2\nl 2 3\nl 4 5\n") != std::string::npos);
            } else {
                CHECK(text.substr(0, 4) == "HAIR");
                REQUIRE(text.size() == 128 + 2 * 2 + 5 * 12 + 5 * 4);
                std::vector<float> points(15);
                std::memcpy(points.data(), text.data() + 132, 60);
                CHECK(points == kPositions);
            }
        }
    }
    const auto wrong = StrandExporter::create("frames.fbx", kTwoStrands, 0.02, 1);
    REQUIRE_FALSE(wrong);
    CHECK(to_string(wrong.error()).find("frames.fbx") == 0);
}
