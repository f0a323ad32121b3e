#include "bake/report.h"

#include "bake/output.h"
#include "schema/files/write_file.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <set>

using namespace keratin;

TEST_CASE("strand numbers become ranges and short text") {
    const std::vector<std::uint32_t> numbers{3, 7, 8, 9, 40, 41, 100};
    const auto ranges = to_ranges(numbers);
    CHECK(ranges == std::vector<StrandRange>{{3, 3}, {7, 9}, {40, 41}, {100, 100}});
    CHECK(strand_total(ranges) == 7);
    CHECK(to_text(ranges, 8) == "3, 7-9, 40-41, 100");
    CHECK(to_text(ranges, 2) == "3, 7-9 and 3 more");
}

TEST_CASE("codes of findings are unique and in order") {
    std::set<std::string_view> codes, names;
    for (std::size_t i = 0; i < kBakeRules.size(); ++i) {
        CHECK(static_cast<std::size_t>(kBakeRules[i].rule) == i);
        codes.insert(kBakeRules[i].code);
        names.insert(kBakeRules[i].name);
    }
    CHECK(codes.size() == kBakeRules.size());
    CHECK(names.size() == kBakeRules.size());
}

TEST_CASE("every code of a finding stands in the docs with its severity and meaning") {
    std::ifstream file(KERATIN_DATA_DIR "/../bake/README.md");
    const std::string text(std::istreambuf_iterator<char>(file), {});
    for (const RuleDescription& rule : kBakeRules) {
        const char* severity = rule.severity == Severity::note      ? "note"
                               : rule.severity == Severity::warning ? "warning"
                                                                    : "error";
        const std::string row = "| " + std::string(rule.code) + " | " + std::string(rule.name) +
                                " | " + severity + " | " + std::string(rule.meaning) + " |";
        INFO(row);
        CHECK(text.find(row) != std::string::npos);
    }
    std::size_t rows = 0;
    for (std::size_t at = text.find("\n| KB"); at != std::string::npos;
         at = text.find("\n| KB", at + 1))
        ++rows;
    CHECK(rows == kBakeRules.size());
}

TEST_CASE("a finding reads as one line with place, code and strands") {
    const Finding finding{
        Rule::degenerate_strand, "hair.tfx", "2 strands are left out", {{3, 3}, {9, 9}}};
    CHECK(finding_text(finding) ==
          "hair.tfx: strands 3, 9: warning KB001 degenerate-strand: 2 strands are left out");
}

TEST_CASE("SARIF names the rule, the file and the strands") {
    const std::vector<Finding> findings{
        {Rule::degenerate_strand, "hair.tfx", "2 strands are left out", {{3, 3}, {9, 12}}}};
    BakeReport report;
    report.recipe = "groom.json";
    const auto sarif = nlohmann::json::parse(report_sarif(report, findings, "1.2.3"));
    CHECK(sarif["version"] == "2.1.0");
    const auto& run = sarif["runs"][0];
    const auto& result = run["results"][0];
    CHECK(run["tool"]["driver"]["rules"][result["ruleIndex"].get<int>()]["id"] == "KB001");
    CHECK(result["ruleId"] == "KB001");
    CHECK(result["level"] == "warning");
    CHECK(result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "hair.tfx");
    CHECK(result["locations"][0]["logicalLocations"][1]["fullyQualifiedName"] == "strands[9-12]");
}

TEST_CASE("a spread has the mean, the 95th percentile and the largest") {
    std::vector<double> values;
    for (int i = 100; i >= 1; --i) values.push_back(i);
    const Spread s = spread_of(values);
    CHECK(s.mean == Approx(50.5));
    CHECK(s.p95 == 95);
    CHECK(s.max == 100);
}

TEST_CASE("a dependency file names each input once, absolute and escaped") {
    const std::vector<std::string> inputs{"/a/hair curves.tfx", "/a/b/../mesh#1.obj", "/a/$x",
                                          "/a/$x"};
    CHECK(dependency_text("out/head.kera", inputs) ==
          "out/head.kera: \\\n  /a/$$x \\\n  /a/hair\\ curves.tfx \\\n  /a/mesh\\#1.obj\n");
}

TEST_CASE("an unchanged output is not written, and its time moves only when asked") {
    namespace fs = std::filesystem;
    const std::string path = (fs::temp_directory_path() / "keratin_output_test.bin").string();
    fs::remove(path);
    const auto bytes = [](const std::string& text) {
        return std::vector<std::byte>(
            reinterpret_cast<const std::byte*>(text.data()),
            reinterpret_cast<const std::byte*>(text.data()) + text.size());
    };
    const std::string one = "one", two = "two";
    CHECK(*write_if_changed(path, bytes(one), Unchanged::touch));
    const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
    fs::last_write_time(path, old);
    CHECK_FALSE(*write_if_changed(path, bytes(one), Unchanged::keep_time));
    CHECK(fs::last_write_time(path) == old);
    CHECK_FALSE(*write_if_changed(path, bytes(one), Unchanged::touch));
    CHECK(fs::last_write_time(path) > old);
    CHECK(*write_if_changed(path, bytes(two), Unchanged::touch));
    CHECK(*read_file(path) == bytes(two));
    fs::remove(path);
    CHECK_FALSE(write_if_changed("/no/such/folder/x", bytes(one), Unchanged::touch));
}
