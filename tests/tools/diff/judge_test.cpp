#include "tools/keratin-diff/judge.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace keratin;
using diff::Severity;

namespace {

// A report in which strand positions differ by 2 mm and three weights differ by 0.1.
diff::Report report() {
    diff::Report report;
    for (const FieldDescription& description : kAssetFields) {
        diff::FieldDifference field;
        field.name = description.name;
        field.unit = description.unit;
        field.is_float = description.is_float;
        if (field.name == "strand_position") {
            field.differing = 5;
            field.spread.max = 2e-3;
        }
        if (field.name == "strand_guide") field.differing = 3;
        report.fields.push_back(field);
    }
    report.recipe.push_back({"recipe", "1", "2"});
    return report;
}

Severity severity(const diff::Tolerances& tolerances, const std::string& name) {
    for (const diff::Finding& finding : diff::judge(report(), tolerances))
        if (finding.name == name) return finding.severity;
    FAIL("no finding " + name);
    return Severity::same;
}

std::string refusal(const std::string& text) {
    diff::Tolerances tolerances;
    const auto warn = tolerances.set_warn(text);
    const auto fail = tolerances.set_fail(text);
    REQUIRE_FALSE(warn);
    REQUIRE_FALSE(fail);
    CHECK(exit_code(fail.error()) == 2);
    return to_string(fail.error());
}

}  // namespace

TEST_CASE("without limits data fail and the origin warns") {
    const diff::Tolerances tolerances;
    CHECK(severity(tolerances, "strand_position") == Severity::failure);
    CHECK(severity(tolerances, "strand_guide") == Severity::failure);
    CHECK(severity(tolerances, "strand_uv") == Severity::same);
    CHECK(severity(tolerances, "recipe") == Severity::warning);
}

TEST_CASE("a difference within its limit is tolerated, beyond it fails") {
    diff::Tolerances tolerances;
    REQUIRE(tolerances.set_fail("strand_position=0.003"));
    CHECK(severity(tolerances, "strand_position") == Severity::tolerated);
    REQUIRE(tolerances.set_fail("strand_position=0.001"));
    CHECK(severity(tolerances, "strand_position") == Severity::failure);
    REQUIRE(tolerances.set_fail("strand_guide=3"));
    CHECK(severity(tolerances, "strand_guide") == Severity::tolerated);
    REQUIRE(tolerances.set_fail("strand_guide=2"));
    CHECK(severity(tolerances, "strand_guide") == Severity::failure);
}

TEST_CASE("two limits make a warning between them; a warning limit alone never fails") {
    diff::Tolerances tolerances;
    REQUIRE(tolerances.set_warn("strand_position=0.001"));
    CHECK(severity(tolerances, "strand_position") == Severity::warning);
    REQUIRE(tolerances.set_fail("strand_position=0.003"));
    CHECK(severity(tolerances, "strand_position") == Severity::warning);
    REQUIRE(tolerances.set_fail("strand_position=0.0015"));
    CHECK(severity(tolerances, "strand_position") == Severity::failure);
}

TEST_CASE("lengths may have units and names may have patterns") {
    diff::Tolerances tolerances;
    REQUIRE(tolerances.set_fail("*_position=2.5mm"));
    CHECK(severity(tolerances, "strand_position") == Severity::tolerated);
    REQUIRE(tolerances.set_fail("strand_position=1500um"));
    CHECK(severity(tolerances, "strand_position") == Severity::failure);
    REQUIRE(tolerances.set_warn("*=1000"));
    CHECK(severity(tolerances, "strand_guide") == Severity::tolerated);
}

TEST_CASE("a wrong tolerance is refused with what would be right") {
    CHECK(refusal("strand_position").find("FIELD=V") != std::string::npos);
    CHECK(refusal("hair=1").find("there are strands, ") != std::string::npos);
    CHECK(refusal("strand_position=much").find("not a number") != std::string::npos);
    CHECK(refusal("strand_position=-1").find("not a number >= 0") != std::string::npos);
    CHECK(refusal("strand_position=inf").find("not a number") != std::string::npos);
    CHECK(refusal("strand_position=1cm").find("use m, mm or um") != std::string::npos);
    CHECK(refusal("strand_uv=1mm").find("is no length") != std::string::npos);
}

TEST_CASE("a field that only one asset has is beyond every limit") {
    diff::Report one_sided = report();
    for (diff::FieldDifference& field : one_sided.fields)
        if (field.name == "strand_uv") field.only_in_b = true;
    diff::Tolerances tolerances;
    REQUIRE(tolerances.set_fail("strand_uv=1000"));
    const auto findings = diff::judge(one_sided, tolerances);
    const auto uv = std::find_if(findings.begin(), findings.end(),
                                 [](const auto& f) { return f.name == "strand_uv"; });
    CHECK(uv->severity == Severity::failure);
}
