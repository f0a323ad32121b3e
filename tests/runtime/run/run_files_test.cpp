#include "runtime/run/points_csv.h"
#include "runtime/run/state_file.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <unistd.h>

using namespace keratin;
namespace fs = std::filesystem;

namespace {

struct Folder {
    fs::path path = fs::temp_directory_path() / ("keratin_run_test_" + std::to_string(::getpid()));
    Folder() {
        fs::remove_all(path);
        fs::create_directories(path);
    }
    ~Folder() { fs::remove_all(path); }
    std::string file(const char* name) const { return (path / name).string(); }
};

std::string read_bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

RunLayout small_layout() {
    RunLayout layout;
    layout.head.solver = "strand";
    layout.head.guide_first_point = {0, 2, 3};
    layout.rest = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    layout.head.assets = {{"a.kera", {1, 2}, 0, 2, 0, 0}};
    return layout;
}

}  // namespace

TEST_CASE("the table of points has a header and every number in full") {
    const Folder folder;
    RunState state;
    state.position = {{0.1, -2, 3e-20}, {1.0 / 3, 0, 1e6}, {static_cast<double>(0.1f), 5, 6}};
    {
        auto csv = PointsCsv::create(folder.file("p.csv"));
        REQUIRE(csv);
        REQUIRE(csv->add(2, 0.25, small_layout(), state));
        CHECK_FALSE(fs::exists(folder.file("p.csv")));
        REQUIRE(csv->finish());
    }
    CHECK(read_bytes(folder.file("p.csv")) ==
          "frame,time,strand,point,x,y,z\n"
          "2,0.25,0,0,0.1,-2,3e-20\n"
          "2,0.25,0,1,0.3333333333333333,0,1e+06\n"
          "2,0.25,1,0,0.10000000149011612,5,6\n");
}

TEST_CASE("a saved run comes back, and only into the scene it came from") {
    const Folder folder;
    const std::string path = folder.file("state");
    const SavedRun saved{7, 3, 0.02, {std::byte{1}, std::byte{2}, std::byte{3}}};
    REQUIRE(save_run(path, saved, small_layout()));
    auto loaded = load_run(path, small_layout());
    REQUIRE(loaded);
    CHECK(loaded->steps == 7);
    CHECK(loaded->steps_per_frame == 3);
    CHECK(loaded->frame == 0.02);
    CHECK(loaded->state == saved.state);

    RunLayout other = small_layout();
    other.head.assets[0].hash.low = 3;
    CHECK(load_run(path, other).error().message.find("another scene") != std::string::npos);

    const std::string good = read_bytes(path);
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ 4);
        std::ofstream(path, std::ios::binary | std::ios::trunc) << bad;
        INFO(i);
        CHECK_FALSE(load_run(path, small_layout()));
        std::ofstream(path, std::ios::binary | std::ios::trunc) << good.substr(0, i);
        CHECK_FALSE(load_run(path, small_layout()));
    }
    CHECK(load_run(folder.file("none"), small_layout()).error().code == ErrorCode::io);
}
