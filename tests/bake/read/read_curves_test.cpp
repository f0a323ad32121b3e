#include "bake/read/read_curves.h"

#include "tests/bake/read/make_bytes.h"
#include "tests/data_dir.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>

#include <limits>

using namespace keratin;

TEST_CASE("a missing file, a folder and an unknown format are told apart") {
    const auto missing = read_curves("nowhere.tfx");
    REQUIRE(!missing);
    CHECK(missing.error().code == ErrorCode::io);
    const auto folder = read_curves(KERATIN_DATA_DIR);
    REQUIRE(!folder);
    CHECK(folder.error().message == "not a regular file");
    const auto unknown = read_curves(KERATIN_DATA_DIR "/LICENCES.md");
    REQUIRE(!unknown);
    CHECK(unknown.error().code == ErrorCode::unsupported);
}

TEST_CASE("a file without one usable curve is an error that names the first fault") {
    std::string bytes;
    test::append(bytes, 4.0f);
    for (std::uint32_t field : {1u, 2u, 160u}) test::append(bytes, field);
    bytes.resize(160, '\0');
    for (int i = 0; i < 8; ++i) test::append(bytes, std::numeric_limits<float>::infinity());
    const test::TemporaryFolder folder;
    const std::string path = folder.write("bad.tfx", bytes);
    const auto groom = read_curves(path);
    REQUIRE(!groom);
    CHECK(groom.error().code == ErrorCode::input);
    CHECK(to_string(groom.error()) ==
          path +
              ": curve 0: point 0 is not finite or is immensely far away; the file holds no "
              "usable curve");
}
