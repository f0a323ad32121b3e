// The rod solver against closed forms and reference solutions: the quick ones of data/validation, by
// the same code as keratin-report validate, which runs them all.
#include "tests/data_dir.h"
#include "tools/keratin-report/case.h"
#include "tools/keratin-report/print.h"

#include <catch2/catch.hpp>

#include <fstream>

using namespace keratin;
using namespace keratin::report;

namespace {

const Json& cases() {
    static const Json document = [] {
        std::ifstream file(KERATIN_DATA_DIR "/validation/public.json");
        return Json::parse(file);
    }();
    return document.at("cases");
}

// Runs the family's cases, at `edges` only (0: at all resolutions), and expects them to pass.
void expect_family(const std::string& family, std::size_t edges) {
    std::size_t found = 0;
    for (Json test : cases()) {
        if (test.at("family") != family) continue;
        ++found;
        if (edges > 0) {
            const std::string key = "N" + std::to_string(edges);
            const double tolerance = test.at("tolerance").at(key).get<double>();
            test["tolerance"] = {{key, tolerance}};
        }
        const Outcome out = run_case(test);
        INFO(outcome_text(out));
        CHECK(out.passed());
    }
    CHECK(found > 0);
}

}  // namespace

TEST_CASE("a cantilever rests where the elastica says") { expect_family("cantilever", 0); }
TEST_CASE("natural curvature and twist make the helix they belong to") { expect_family("helix", 20); }
TEST_CASE("curls under gravity rest where the Kirchhoff equations say") { expect_family("kirchhoff-3d", 20); }
TEST_CASE("a slack strand hangs as a catenary") { expect_family("catenary", 0); }
TEST_CASE("a hanging strand stretches under its own weight") { expect_family("self-stretch", 0); }
TEST_CASE("a clamped strand vibrates at the beam's frequency") { expect_family("vibration", 20); }
TEST_CASE("a strand on an incline sticks, or slides as the law of friction says") { expect_family("incline", 0); }
TEST_CASE("a sliding strand stops where friction stops it") { expect_family("sliding-block", 0); }
TEST_CASE("the end of a buckled strand slips at the friction of the elastica") { expect_family("stick-slip", 0); }
TEST_CASE("an impact keeps momentum and gains no energy") { expect_family("free-rod-contact", 0); }
TEST_CASE("the residual of the contact law has its reference values") { expect_family("coulomb-residual", 0); }

TEST_CASE("a case of an unknown family is not applicable, never passed") {
    const Outcome out = run_case({{"id", "x"}, {"family", "knot"}});
    CHECK(!out.passed());
    CHECK(!out.not_applicable.empty());
    CHECK(all_passed({out}));
}

TEST_CASE("a check that is not a number fails") {
    CHECK(!Check{"x", 1, 1, std::nan(""), 1}.passed());
    CHECK(!all_passed({Outcome{"a", "b", {{"x", 2, 1, 1, 0.5}}, "", 0}}));
}
