// keratin-diff on cached runs.
#include "schema/cache.h"
#include "tests/json_schema.h"
#include "tools/keratin-diff/compare_runs.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

using namespace keratin;
using nlohmann::json;

namespace {

struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("keratin_diff_runs_" + std::to_string(getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
};

// A run of three strands of two points, of which the last two are drawn; `edit` changes a frame.
template <class Edit>
std::string write_run(const Folder& folder, const std::string& name, std::uint32_t frames,
                      Edit&& edit, CacheHead head = {}) {
    head.solver = "strand";
    head.frame = 0.1;
    if (head.assets.empty()) head.assets = {{"a.kera", {1, 2}, 0, 3, 0, 2}};
    head.guide_first_point = {0, 2, 4, 6};
    head.guide_lane = {0, 1, 2};
    head.strand_first_point = {0, 2, 4};
    head.strand_radius = {1e-4f, 1e-4f};
    auto writer = CacheWriter::create(folder.file(name), head);
    REQUIRE(writer);
    for (std::uint32_t f = 0; f < frames; ++f) {
        CacheFrame frame;
        frame.number = f;
        frame.time = 0.1 * f;
        frame.guide_position.assign(18, 0.5f);
        frame.strand_position.assign(12, 0.25f);
        frame.bodies.resize(1);
        edit(frame);
        REQUIRE(writer->write(frame));
    }
    REQUIRE(writer->finish());
    return folder.file(name);
}

const auto as_it_is = [](CacheFrame&) {};

std::vector<diff::RunDifference> compare(const std::string& a, const std::string& b) {
    auto x = CacheReader::open(a), y = CacheReader::open(b);
    REQUIRE(x);
    REQUIRE(y);
    auto differences = diff::compare_runs(*x, *y);
    REQUIRE(differences);
    return *differences;
}

// Names of what differs, with a blank after each.
std::string differing(const std::vector<diff::RunDifference>& differences) {
    std::string names;
    for (const auto& d : differences)
        if (d.value() > 0) names += d.name + " ";
    return names;
}

std::string content(const std::string& path) {
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

int run(const Folder& folder, const std::string& arguments) {
    const std::string command = "'" KERATIN_DIFF_PROGRAM "' " + arguments + " >" +
                                folder.file("out") + " 2>" + folder.file("err");
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("a change in one part of a cached run is named, and nothing else") {
    const Folder folder;
    const std::string a = write_run(folder, "a.kcache", 3, as_it_is);
    CHECK(differing(compare(a, a)) == "");
    const auto changed = [&](auto&& edit) {
        return differing(compare(a, write_run(folder, "b.kcache", 3, edit)));
    };
    CHECK(changed([](CacheFrame& f) { f.guide_position[7] += 1e-3f; }) == "guide_position ");
    CHECK(changed([](CacheFrame& f) { f.strand_position[0] += 1e-3f; }) == "strand_position ");
    CHECK(changed([](CacheFrame& f) { f.time += 1e-6; }) == "time ");
    CHECK(changed([](CacheFrame& f) { f.bodies[0].motion.translation[1] = 2; }) ==
          "body_position ");
    CHECK(differing(compare(a, write_run(folder, "b.kcache", 5, as_it_is))) == "frames ");
    CacheHead head;
    head.assets = {{"a.kera", {1, 3}, 0, 3, 0, 2}};
    CHECK(differing(compare(a, write_run(folder, "b.kcache", 3, as_it_is, head))) == "assets ");
}

TEST_CASE("the worst point of two cached runs is named with frame, strand and both values") {
    const Folder folder;
    const std::string a = write_run(folder, "a.kcache", 50, as_it_is);
    const std::string b = write_run(folder, "b.kcache", 50, [](CacheFrame& f) {
        f.guide_position[3] += 1e-4f;                            // strand 0 point 1, every frame
        if (f.number == 7) f.guide_position[13] = 0.5f + 0.25f;  // strand 2 point 0
    });
    const auto differences = compare(a, b);
    const auto& d = differences[2];
    REQUIRE(d.name == "guide_position");
    CHECK(d.compared == 50 * 6);
    CHECK(d.differing == 51);
    CHECK(d.spread.max == 0.25);
    CHECK(d.spread.p99 == Approx(1e-4).epsilon(0.02));
    CHECK(d.spread.rms == Approx(std::sqrt(0.0625 / 300)).epsilon(1e-3));
    CHECK(
        diff::describe(differences, "guide_position")
            .find(
                "worst: frame 7 simulated strand 2 point 0: (0.5, 0.5, 0.5) -> (0.5, 0.75, 0.5)") !=
        std::string::npos);
}

TEST_CASE("keratin-diff judges cached runs by limits and prints text, JSON and JUnit") {
    const Folder folder;
    const std::string a = write_run(folder, "a.kcache", 3, as_it_is);
    const std::string b =
        write_run(folder, "b.kcache", 3, [](CacheFrame& f) { f.strand_position[0] += 1e-3f; });
    const std::string pair = a + " " + b;
    CHECK(run(folder, a + " " + a) == 0);
    CHECK(run(folder, pair) == 1);
    CHECK(content(folder.file("out")).find("failure   strand_position: 3 of 12 differ; max 1 mm") ==
          0);
    CHECK(run(folder, pair + " --fail strand_position=2mm") == 0);
    CHECK(run(folder, pair + " --fail '*_position=0.5mm'") == 1);
    CHECK(run(folder, pair + " --warn strand_position=0.5mm") == 0);
    CHECK(run(folder, pair + " --warn strand_position=0.5mm --strict") == 1);
    CHECK(run(folder, pair + " --fail strand_uv=1") == 2);
    CHECK(content(folder.file("err")).find("there are frames, strands") != std::string::npos);
    CHECK(run(folder, pair + " --json --junit " + folder.file("j.xml")) == 1);
    const json document = json::parse(content(folder.file("out")));
    const json schema =
        json::parse(content(KERATIN_SCHEMA_DIR "/report/keratin-diff-runs.schema.json"));
    CHECK(test::schema_misfit(schema, document) == "");
    CHECK(document["findings"].size() == 1);
    CHECK(content(folder.file("j.xml")).find("tests=\"7\" failures=\"1\"") != std::string::npos);
    CHECK(run(folder, a + " " + folder.file("x.kera")) == 2);
    CHECK(content(folder.file("err")).find("cannot be compared") != std::string::npos);
    std::ofstream(folder.file("b.kcache"), std::ios::trunc) << "nothing";
    CHECK(run(folder, pair) == 2);
}
