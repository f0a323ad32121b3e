// Runs the program keratin-view itself.
#include "tests/data_dir.h"
#include "tests/tools/view/small_run.h"
#include "tools/keratin-view/image.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <fstream>
#include <sys/wait.h>

using namespace keratin;
using keratin::test::Folder;

namespace {

struct Outcome {
    int code = -1;
    std::string text;
};
// What the program writes to stdout, or with "2>&1 >/dev/null" in the arguments to stderr.
Outcome run(const std::string& arguments, const std::string& before = "",
            const std::string& program = KERATIN_VIEW_PROGRAM) {
    Outcome outcome;
    std::FILE* pipe = popen((before + " '" + program + "' " + arguments).c_str(), "r");
    REQUIRE(pipe);
    std::array<char, 4096> buffer;
    while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
        outcome.text.append(buffer.data(), n);
    const int status = pclose(pipe);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome;
}

const std::string kQuick = " --size 60x40 --samples 1";

}  // namespace

TEST_CASE("keratin-view draws an asset and reports in JSON what it drew") {
    const Folder folder("program");
    test::write_small_asset(folder.file("a.kera"));
    const auto outcome = run(folder.file("a.kera") + " -o " + folder.file("a.png") + kQuick +
                             " --json --show hair,guides,mesh,colliders");
    REQUIRE(outcome.code == 0);
    const auto document = nlohmann::json::parse(outcome.text);
    CHECK(document["strands"] == 7);
    CHECK(document["guides"] == 5);
    CHECK(document["width"] == 60);
    CHECK(document["widened_points"] > 0);
    CHECK(document["largest_widening"] > 1);
    const auto image = view::read_image(folder.file("a.png"));
    REQUIRE(image);
    CHECK(image->width == 60);
    CHECK(image->height == 40);
    CHECK(run(folder.file("a.kera") + " -o " + folder.file("a.png") + kQuick + " --quiet")
              .text.empty());
}

TEST_CASE("what keratin-view prints as JSON is what its schema lists") {
    const Folder folder("schema");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    std::ifstream file(KERATIN_DATA_DIR "/../schema/report/keratin-view.schema.json");
    const auto schema = nlohmann::json::parse(file);
    const auto outcome = run(folder.file("a.kcache") + " -o " + folder.file("a.png") + kQuick +
                             " --json --color density");
    const auto document = nlohmann::json::parse(outcome.text);
    for (const auto& required : schema["required"]) CHECK(document.contains(required));
    for (const auto& [key, value] : document.items()) {
        CAPTURE(key);
        REQUIRE(schema["properties"].contains(key));
        const auto& property = schema["properties"][key];
        if (!property.contains("type")) continue;
        const std::string type = property["type"];
        CHECK((type == "integer"  ? value.is_number_integer()
               : type == "number" ? value.is_number()
               : type == "string" ? value.is_string()
               : type == "array"  ? value.is_array()
                                  : value.is_object()));
    }
}

TEST_CASE("keratin-view draws frames of a run, one or as a sheet, in the solver's colours") {
    const Folder folder("frames");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    const std::string cache = folder.file("a.kcache"), png = folder.file("a.png");
    for (const char* color : {"natural", "strand", "density", "velocity"}) {
        CAPTURE(color);
        CHECK(run(cache + " -o " + png + kQuick + " --frame 1 --color " + color).code == 0);
    }
    const auto sheet = run(cache + " -o " + png + kQuick + " --json --frames 0,2,3");
    REQUIRE(sheet.code == 0);
    const auto frames = nlohmann::json::parse(sheet.text)["frames"];
    REQUIRE(frames.size() == 3);
    CHECK(frames[1]["frame"] == 2);
    CHECK(view::read_image(png)->width > 60);
    const auto all = run(cache + " -o " + png + kQuick + " --json --sheet 9");
    const auto every = nlohmann::json::parse(all.text)["frames"];
    REQUIRE(every.size() == 4);
    for (std::uint32_t i = 0; i < 4; ++i) CHECK(every[i]["frame"] == i);
}

TEST_CASE("several inputs stand side by side, a row each, and every frame says whose it is") {
    const Folder folder("several");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    test::write_small_run(folder.file("a.kera"), folder.file("b.kcache"));
    const std::string a = folder.file("a.kcache"), b = folder.file("b.kcache"),
                      png = folder.file("a.png");
    const int gap = 4, w = 60 + gap, h = 40 + gap;
    const auto outcome = run(a + " " + b + " -o " + png + kQuick + " --json --frames 0,1,3");
    REQUIRE(outcome.code == 0);
    const auto document = nlohmann::json::parse(outcome.text);
    CHECK(document["input"] == a);
    CHECK(document["inputs"] == nlohmann::json({a, b}));
    REQUIRE(document["frames"].size() == 6);
    CHECK(document["frames"][2]["input"] == a);
    CHECK(document["frames"][3]["input"] == b);
    CHECK(document["frames"][3]["frame"] == 0);
    auto sheet = view::read_image(png);
    REQUIRE(sheet);
    CHECK(sheet->width == gap + 3 * w);
    CHECK(sheet->height == gap + 2 * h);

    CHECK(run(a + " " + b + " -o " + png + kQuick + " --frames 0,1,3 --columns 2").code == 0);
    sheet = view::read_image(png);
    CHECK(sheet->width == gap + 2 * w);
    CHECK(sheet->height == gap + 3 * h);

    // One picture each: an asset at rest and the last frame of a run.
    CHECK(run(folder.file("a.kera") + " " + a + " -o " + png + kQuick + " --columns 5").code == 0);
    CHECK(view::read_image(png)->width == gap + 2 * w);
}

TEST_CASE("a film gets every frame, and is left behind only when it is whole") {
    const Folder folder("film");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    const std::string arguments =
        folder.file("a.kcache") + kQuick + " --quiet --film " + folder.file("a.mp4");
    // Stands for ffmpeg: keeps what it is given in the file that it is asked for.
    const auto install = [&](const std::string& script) {
        std::filesystem::create_directories(folder.path / "bin");
        std::ofstream(folder.file("bin/ffmpeg")) << "#!/bin/sh\n" << script;
        std::filesystem::permissions(folder.file("bin/ffmpeg"), std::filesystem::perms::owner_all);
    };
    const auto files = [&] {
        return std::distance(std::filesystem::directory_iterator(folder.path), {});
    };
    const auto before = files();
    const auto missing = run(arguments + " 2>&1", "PATH=/nowhere");
    CHECK(missing.code == 2);
    CHECK(missing.text.find("apt-get install ffmpeg") != std::string::npos);
    CHECK(files() == before);

    install("for last; do :; done; cat > \"$last\"\n");
    const std::string path = "PATH=" + folder.path.string() + "/bin:$PATH";
    CHECK(run(arguments, path).code == 0);
    CHECK(std::filesystem::file_size(folder.file("a.mp4")) == 4 * 60 * 40 * 3);
    CHECK(run(arguments + " --every 2", path).code == 0);
    CHECK(std::filesystem::file_size(folder.file("a.mp4")) == 2 * 60 * 40 * 3);
    std::filesystem::remove(folder.file("a.mp4"));

    install("cat > /dev/null; exit 1\n");
    CHECK(run(arguments, path).code == 2);
    CHECK_FALSE(std::filesystem::exists(folder.file("a.mp4")));
    CHECK(files() == before + 1);  // bin
}

TEST_CASE("keratin-view refuses wrong use with exit code 2, one line and no picture") {
    const Folder folder("wrong");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    std::ofstream(folder.file("broken.kera")) << "not an asset";
    const std::string asset = folder.file("a.kera"),
                      out = " -o " + folder.file("wrong.png") + kQuick;
    struct Case {
        std::string arguments, says;
    };
    for (const Case& c :
         {Case{"", "input"},
          {asset, "-o"},
          {folder.file("none.kera") + out, "none.kera"},
          {folder.file("broken.kera") + out, "broken.kera"},
          {asset + out + " --nonsense", "nonsense"},
          {asset + " -o x.png --size 10", "--size"},
          {asset + " -o x.png --size 20000x20000", "16384"},
          {asset + out + " --camera 1", "--camera"},
          {asset + out + " --look-from 1,2", "--look-from"},
          {asset + out + " --color blue", "--color"},
          {asset + out + " --color texture=/none.png", "/none.png"},
          {asset + out + " --hair-color bronde", "--hair-color"},
          {asset + out + " --show teeth", "--show"},
          {asset + out + " --samples 0", "--samples"},
          {asset + out + " --frame 3", "--frame"},
          {asset + out + " --color velocity", "--color velocity"},
          {asset + out + " --mesh /none.obj", "/none.obj"},
          {folder.file("a.kcache") + out + " --frame 4", "0 to 3"},
          {asset + " " + asset + " --cache " + folder.file("a.kcache") + out, "--cache"},
          {folder.file("a.kcache") + " " + folder.file("a.kcache") + " --film " +
               folder.file("wrong.mp4"),
           "--film"},
          {asset + " " + folder.file("none.kera") + out, "none.kera"},
          {asset + out + " --columns 0", "--columns"},
          {asset + " -o " + folder.file("no_folder/a.png") + kQuick, "no_folder"}}) {
        CAPTURE(c.arguments);
        const auto outcome = run(c.arguments + " 2>&1 >/dev/null");
        CHECK(outcome.code == 2);
        CHECK(outcome.text.find(c.says) != std::string::npos);
        CHECK(std::count(outcome.text.begin(), outcome.text.end(), '\n') == 1);
        CHECK_FALSE(std::filesystem::exists(folder.file("wrong.png")));
    }
}

TEST_CASE("keratin-diff draws the difference of two assets or runs") {
    const Folder folder("difference");
    test::write_small_asset(folder.file("a.kera"));
    test::write_small_run(folder.file("a.kera"), folder.file("a.kcache"));
    auto moved = test::small_asset();
    moved.strand_position[3 * 7] += 0.005f;
    test::write_small_asset(folder.file("b.kera"), moved);
    const std::string png = folder.file("d.png");
    const auto diff = [&](const std::string& a, const std::string& b) {
        return run(folder.file(a) + " " + folder.file(b) + " --quiet --image " + png, "",
                   KERATIN_DIFF_PROGRAM);
    };
    CHECK(diff("a.kera", "b.kera").code == 1);
    const auto different = view::read_image(png);
    REQUIRE(different);
    CHECK(diff("a.kera", "a.kera").code == 0);
    const auto same = view::read_image(png);
    REQUIRE(same);
    CHECK(same->rgb != different->rgb);
    CHECK(diff("a.kcache", "a.kcache").code == 0);
}

TEST_CASE("keratin-view explains itself") {
    const auto help = run("--help");
    CHECK(help.code == 0);
    CHECK(help.text.find("--camera") != std::string::npos);
    CHECK(help.text.find("Exit codes") != std::string::npos);
    const auto version = run("--version");
    CHECK(version.code == 0);
    CHECK(version.text.find("revision") != std::string::npos);
}
