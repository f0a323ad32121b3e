// What keratin-report curve reads, draws and says.
#include "tools/keratin-report/convergence.h"

#include "schema/files/write_file.h"
#include "tests/json_schema.h"
#include "tests/run_program.h"
#include "tests/xml.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <unistd.h>

using namespace keratin;
using namespace keratin::report;
using test::content;
using test::Outcome;

namespace {

struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("keratin_report_" + std::to_string(getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
    std::string file(const std::string& name, const std::string& text) const {
        REQUIRE(write_file(file(name), text));
        return file(name);
    }
};

Outcome run(const Folder& folder, const std::string& arguments) {
    return test::run_program(folder, KERATIN_REPORT_PROGRAM, arguments);
}

const std::string kTwo = R"({"solver": "rod", "convergence": [
  {"dv": 1e-2, "dr": 1e-9, "f_fb": 0.5},
  {"dv": 1e-4, "dr": 1e-11, "f_fb": null},
  {"dv": 0, "dr": 0, "f_fb": 1e-6}]})";

}  // namespace

TEST_CASE("the figures of a run become three lines over the iteration, without what is absent") {
    const Folder folder;
    const auto convergence = read_convergence(folder.file("two.json", kTwo));
    REQUIRE(convergence);
    const auto chart = convergence_chart(*convergence, "title");
    CHECK(chart.title == "title");
    REQUIRE(chart.lines.size() == 3);
    CHECK(chart.lines[0].x == std::vector<double>{1, 2, 3});
    CHECK(chart.lines[0].y == std::vector<double>{1e-2, 1e-4, 0});
    CHECK(chart.lines[1].y == std::vector<double>{1e-9, 1e-11, 0});
    CHECK(chart.lines[2].x == std::vector<double>{1, 3});
    CHECK(chart.lines[2].y == std::vector<double>{0.5, 1e-6});

    const auto free = read_convergence(
        folder.file("free.json", R"({"convergence": [{"dv": 1, "dr": 0, "f_fb": null}]})"));
    REQUIRE(free);
    CHECK(convergence_chart(*free, "").lines.size() == 2);
}

TEST_CASE("keratin-report curve writes the picture and says in JSON what it drew") {
    const Folder folder;
    const std::string stats = folder.file("two.json", kTwo), svg = folder.file("two.svg");
    const auto outcome = run(folder, "curve " + stats + " -o " + svg + " --json --size 600x300");
    REQUIRE(outcome.code == 0);
    CHECK(outcome.err.empty());
    const auto document = nlohmann::json::parse(outcome.out);
    std::ifstream schema(KERATIN_SCHEMA_DIR "/report/keratin-report-curve.schema.json");
    CHECK(test::schema_misfit(nlohmann::json::parse(schema), document) == "");
    CHECK(document["iterations"] == 3);
    CHECK(document["lines"][0]["first"] == 1e-2);
    CHECK(document["lines"][0]["last"] == 0);
    const auto picture = test::read_xml(content(svg));
    CHECK(picture.number("width") == 600);
    CHECK(picture.all("title")[0]->text == "The last step of two");

    CHECK(run(folder, "curve " + stats + " -o " + svg + " --title 'a & b' --quiet").out.empty());
    CHECK(test::read_xml(content(svg)).all("title")[0]->text == "a & b");
    CHECK(run(folder, "curve " + stats + " -o " + svg).out.find("3 iterations") !=
          std::string::npos);
    const auto help = run(folder, "curve --help");
    CHECK(help.code == 0);
    CHECK(help.out.find("--convergence --stats") != std::string::npos);
}

TEST_CASE("keratin-report curve refuses what it cannot draw in one line, writing nothing") {
    const Folder folder;
    const std::string svg = folder.file("out.svg"), o = " -o " + svg,
                      two = folder.file("two.json", kTwo);
    const auto with = [&](const std::string& text) { return folder.file("wrong.json", text) + o; };
    struct Case {
        std::string arguments, says;
    };
    const auto refused = [&](const std::string& arguments, const std::string& says) {
        CAPTURE(arguments);
        const auto outcome = run(folder, "curve " + arguments);
        CHECK(outcome.code == 2);
        CHECK(outcome.out.empty());
        CAPTURE(outcome.err);
        CHECK(outcome.err.find(says) != std::string::npos);
        CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
        CHECK_FALSE(std::filesystem::exists(svg));
    };
    refused("", "stats");
    refused(two, "-o");
    refused(folder.file("none.json") + o, "none.json");
    refused(folder.path.string() + o, folder.path.string());
    refused(with("{\n  \"convergence\": [}"), "wrong.json:2:19: is not JSON");
    refused(with(""), "wrong.json: the file is empty");
    refused(with("{}"), "holds no \"convergence\"; keratin-run");
    refused(with("[1]"), "holds no \"convergence\"");
    refused(with(R"({"convergence": 3})"), "convergence: must be a list");
    refused(with(R"({"convergence": []})"), "nothing to draw");
    refused(with(R"({"convergence": [3]})"), "convergence[0]: must be an object");
    refused(with(R"({"convergence": [{"dv": 1, "dr": 0}, {"dv": 1}]})"),
            "convergence[1].dr: is missing");
    refused(with(R"({"convergence": [{"dv": -1, "dr": 0}]})"), "convergence[0].dv: is -1");
    refused(with(R"({"convergence": [{"dv": 1, "dr": "0"}]})"), "convergence[0].dr: is \"0\"");
    refused(with(R"({"convergence": [{"dv": 1, "dr": 0, "f_fb": 1e305}]})"), "f_fb: is 1e+305");
    refused(two + o + " --size 10", "--size");
    refused(two + o + " --size 100x400", "200 to 8000");
    refused(two + " -o out.png", "end its name in .svg");
    refused(two + " -o " + folder.file("no_folder/a.svg"), "no_folder");
    refused(folder.file("a.svg", kTwo) + " -o " + folder.file("a.svg"), "overwrite");
    CHECK(content(folder.file("a.svg")) == kTwo);
}
