// Runs the program keratin-diff itself.
#include "schema/files/write_file.h"
#include "tests/data_dir.h"
#include "tests/run_program.h"
#include "tests/tools/diff/full_asset.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

using namespace keratin;
using nlohmann::json;
using test::content;
using test::full_asset;
using test::FullAsset;
using test::Outcome;

namespace {

// A folder of its own that goes away with the test.
struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("keratin_diff_" + std::to_string(getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
    std::string asset(const std::string& name, const FullAsset& asset) const {
        REQUIRE(write_file(file(name), test::OpenAsset(asset).view().bytes()));
        return file(name);
    }
};

Outcome run(const Folder& folder, const std::string& arguments) {
    return test::run_program(folder, KERATIN_DIFF_PROGRAM, arguments);
}

FullAsset edited() {
    FullAsset asset = full_asset();
    asset.strand_position[3 * asset.strand_first_point[5] + 6] += 1e-3f;
    return asset;
}

// The parts of JSON Schema that schema/report uses; empty when the value fits, else where not.
std::string misfit(const json& schema, const json& value, const json& root, const std::string& at) {
    if (schema.contains("$ref")) {
        const std::string pointer = std::string(schema["$ref"]).substr(1);
        return misfit(root.at(json::json_pointer(pointer)), value, root, at);
    }
    const auto is = [&](const std::string& type) {
        return type == "object"    ? value.is_object()
               : type == "array"   ? value.is_array()
               : type == "string"  ? value.is_string()
               : type == "boolean" ? value.is_boolean()
               : type == "integer" ? value.is_number_integer()
               : type == "number"  ? value.is_number()
                                   : type == "null" && value.is_null();
    };
    const json types = schema["type"].is_array() ? schema["type"] : json::array({schema["type"]});
    if (std::none_of(types.begin(), types.end(), [&](const json& t) { return is(t); }))
        return at + " has the wrong type";
    if (schema.contains("enum") &&
        std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end())
        return at + " has an unknown value";
    if (schema.contains("const") && schema["const"] != value) return at + " has another value";
    if (value.is_object()) {
        for (const auto& name : schema["required"])
            if (!value.contains(name)) return at + " lacks " + std::string(name);
        for (const auto& [name, member] : value.items()) {
            if (!schema["properties"].contains(name)) return at + "." + name + " is not listed";
            if (auto wrong = misfit(schema["properties"][name], member, root, at + "." + name);
                !wrong.empty())
                return wrong;
        }
    }
    if (value.is_array())
        for (const json& item : value)
            if (auto wrong = misfit(schema["items"], item, root, at + "[]"); !wrong.empty())
                return wrong;
    return "";
}

}  // namespace

TEST_CASE("keratin-diff exits with 0 for equal assets, 1 for others, and says what differs") {
    const Folder folder;
    const std::string a = folder.asset("a.kera", full_asset());
    const std::string b = folder.asset("b.kera", edited());
    CHECK(run(folder, a + " " + a).code == 0);
    const Outcome different = run(folder, a + " " + b);
    CHECK(different.code == 1);
    CHECK(different.err.empty());
    CHECK(different.out.find("failure   strand_position: 1 of 28 points differ; max 1 mm") == 0);
    CHECK(different.out.find("1 failure, 0 warnings, 0 tolerated\n") != std::string::npos);
    CHECK(run(folder, a + " " + b + " --quiet").out.empty());
}

TEST_CASE("limits of keratin-diff decide its exit code") {
    const Folder folder;
    const std::string pair =
        folder.asset("a.kera", full_asset()) + " " + folder.asset("b.kera", edited());
    CHECK(run(folder, pair + " --fail strand_position=2mm").code == 0);
    CHECK(run(folder, pair + " --tolerance strand_position=0.5mm").code == 1);
    CHECK(run(folder, pair + " --warn strand_position=0.5mm").code == 0);
    CHECK(run(folder, pair + " --warn strand_position=0.5mm --strict").code == 1);
    CHECK(run(folder, pair + " --warn strand_position=2mm --strict").code == 0);
    const Outcome tolerated = run(folder, pair + " --fail strand_position=2mm");
    CHECK(tolerated.out.find("tolerated strand_position") == 0);
    CHECK(tolerated.out.find("allowed: 0.002 m") != std::string::npos);
}

TEST_CASE("the document of keratin-diff --json is what its schema says") {
    const Folder folder;
    const json schema =
        json::parse(content(KERATIN_DATA_DIR "/../schema/report/keratin-diff.schema.json"));
    FullAsset other = edited();
    other.strand_triangle[6] = 3;
    other.strand_group[2] = 1;
    other.strand_uv.clear();
    other.info.recipe_hash = {4, 4};
    for (float& x : other.mesh_position) x += 0.25f;
    lay_out_strands(other, {6, 0, 1, 2, 3, 5, 4});
    const std::string a = folder.asset("a.kera", full_asset());
    const Outcome outcome = run(folder, a + " " + folder.asset("b.kera", other) + " --json");
    CHECK(outcome.code == 1);
    CHECK(outcome.err.empty());
    const json document = json::parse(outcome.out);
    CHECK(misfit(schema, document, schema, "document") == "");
    std::vector<std::string> names;
    for (const json& finding : document["findings"]) names.push_back(finding["name"]);
    CHECK(names == std::vector<std::string>{"strand_order", "strand_position", "strand_group",
                                            "strand_triangle", "strand_uv", "mesh_position",
                                            "recipe"});
    for (const json& field : document["fields"])
        if (field["name"] == "strand_group") {
            CHECK(field["worst"]["a"] == json::array({"default"}));
            CHECK(field["worst"]["b"] == json::array({"fringe"}));
        }
    const json same = json::parse(run(folder, a + " " + a + " --json").out);
    CHECK(misfit(schema, same, schema, "document") == "");
    CHECK(same["passed"] == true);
}

TEST_CASE("keratin-diff --junit writes a case a name and counts the failures") {
    const Folder folder;
    FullAsset other = edited();
    other.info.recipe_hash = {4, 4};
    other.info.groups[0].name = "<a & \"b\">";
    const std::string pair =
        folder.asset("a.kera", full_asset()) + " " + folder.asset("b.kera", other);
    const std::string junit = folder.file("diff.xml");
    CHECK(run(folder, pair + " --junit " + junit).code == 1);
    const std::string text = content(junit);
    INFO(text);
    CHECK(text.find("failures=\"2\"") != std::string::npos);
    CHECK(text.find("name=\"strand_position\">\n      <failure message=\"failure: 1 of") !=
          std::string::npos);
    CHECK(text.find("name=\"strand_uv\"/>") != std::string::npos);
    CHECK(text.find("name=\"recipe\">\n      <system-out>") != std::string::npos);
    CHECK(text.find("&lt;a &amp; &quot;b&quot;&gt;") != std::string::npos);
    run(folder, pair + " --strict --junit " + junit);
    CHECK(content(junit).find("failures=\"3\"") != std::string::npos);
}

TEST_CASE("keratin-diff --text depends on the asset alone and changes with each field") {
    const Folder folder;
    const std::string a = folder.asset("a.kera", full_asset());
    const std::string copy = folder.asset("copy.kera", full_asset());
    const std::string text = run(folder, "--text " + a).out;
    CHECK(text == run(folder, "--text " + copy).out);
    CHECK(text.find("strands: 7 with 28 points\n") != std::string::npos);
    CHECK(text.find("field strand_id: 7 from 0 to 6 ") != std::string::npos);
    CHECK(text.find("field strand_uv: 14 from 0.5 to 0.5 ") != std::string::npos);
    CHECK(std::count(text.begin(), text.end(), '\n') < 60);
    const std::string changed = run(folder, "--text " + folder.asset("b.kera", edited())).out;
    std::istringstream before(text), after(changed);
    std::vector<std::string> lines;
    for (std::string x, y; std::getline(before, x) && std::getline(after, y);)
        if (x != y) lines.push_back(x.substr(0, x.find(':')));
    CHECK(lines == std::vector<std::string>{"field strand_position"});
}

TEST_CASE("keratin-diff refuses wrong use and bad input with exit code 2 and a message") {
    const Folder folder;
    const std::string a = folder.asset("a.kera", full_asset());
    const auto refused = [&](const std::string& arguments, const std::string& part) {
        const Outcome outcome = run(folder, arguments);
        INFO(arguments);
        INFO(outcome.err);
        CHECK(outcome.code == 2);
        CHECK(outcome.out.empty());
        CHECK(outcome.err.find(part) != std::string::npos);
    };
    refused("", "a.kera b.kera");
    refused(a, "a.kera b.kera");
    refused(a + " " + folder.file("missing.kera"), "missing.kera: cannot open");
    REQUIRE(write_file(folder.file("foreign.kera"), "certainly no asset"));
    refused(a + " " + folder.file("foreign.kera"), "foreign.kera: not a keratin asset");
    refused(folder.file("foreign.kera") + " " + a, "not a keratin asset");
    refused("--text " + folder.file("foreign.kera"), "not a keratin asset");
    refused("--text " + a + " --json", "--json");
    std::vector<std::byte> damaged = *read_file(a);
    damaged[damaged.size() / 2] ^= std::byte{1};
    REQUIRE(write_file(folder.file("damaged.kera"), damaged));
    refused(a + " " + folder.file("damaged.kera"), "damaged");
    refused(a + " " + a + " --fail hair=1", "no field is called \"hair\"");
    refused(a + " " + a + " --warn strand_position", "FIELD=V");
    refused(a + " " + a + " --unknown", "--unknown");
    refused(a + " " + a + " --junit " + folder.file("no/such/folder.xml"), "cannot write");
    CHECK(run(folder, "--help").code == 0);
    CHECK(run(folder, "--version").out.find("keratin-diff ") == 0);
}
