#include "schema/read/json.h"

#include <catch2/catch.hpp>

using namespace keratin;

namespace {

std::string failure(const std::string& text) {
    auto parsed = parse_json(text, "t.json");
    return parsed ? "accepted" : to_string(parsed.error());
}

}  // namespace

TEST_CASE("a JSON value knows its line and column") {
    const std::string text = "{ // comment\n  \"a\": [1, /* two */ -2.5e1,\n\t\"x\\u00e9\\n\"] }";
    auto parsed = parse_json(text, "t.json");
    REQUIRE(parsed);
    const JsonValue& a = json_at(*parsed, "a");
    REQUIRE(a.items.size() == 3);
    CHECK(a.line == 2);
    CHECK(a.column == 8);
    CHECK(a.items[1].number == -25);
    CHECK(a.items[1].column == 22);
    CHECK(a.items[2].text == "x\xc3\xa9\n");
    CHECK(a.items[2].line == 3);
    CHECK(a.items[2].column == 2);
}

TEST_CASE("what is not JSON is refused with the place and the reason") {
    CHECK(failure("{ \"a\": nan }") ==
          "t.json:1:8: expected a value but found `nan`; a number is written in digits, a word "
          "between \" and \"");
    CHECK(failure("{ \"a\": +1 }") == "t.json:1:8: expected a value but found `+`");
    CHECK(failure("{ \"a\": sin(1) }").find("found `sin`") != std::string::npos);
    CHECK(failure("{ \"a\": 0x10 }") == "t.json:1:8: numbers are written in decimal");
    CHECK(failure("{ \"a\": 012 }") == "t.json:1:8: a number does not start with 0");
    CHECK(failure("{ \"a\": 1. }") == "t.json:1:10: this number lacks a digit here");
    CHECK(failure("{ \"a\": 1,\n }") == "t.json:2:2: a comma before } is one too many");
    CHECK(failure("[1, 2,]") == "t.json:1:7: a comma before ] is one too many");
    CHECK(failure("{ a: 1 }") ==
          "t.json:1:3: expected the name of a field between \" and \" but found `a`");
    CHECK(failure("{ \"a\": 1, \"a\": 2 }") == "t.json:1:11: the field `a` is written twice");
    CHECK(failure("{ \"a\" 1 }") ==
          "t.json:1:7: expected : after the name of a field but found `1`");
    CHECK(failure("{ \"a\": 1 ") == "t.json:1:10: expected , or } but found the end of the file");
    CHECK(failure("{ \"a\": \"x\n\" }") == "t.json:1:8: this string has no closing \"");
    CHECK(failure("{} {}") == "t.json:1:4: expected the end of the file after the outermost value");
    CHECK(failure("/* open") == "t.json:1:1: this comment has no end; write */");
    CHECK(failure("\"\\ud800\"") == "t.json:1:2: half of a surrogate pair");
    CHECK(failure("\"\\q\"").find("unknown escape") != std::string::npos);
    CHECK(failure("") == "t.json:1:1: expected a value but found the end of the file");
    CHECK(failure(std::string(100, '[')).find("nested too deep") != std::string::npos);
}

TEST_CASE("comments turn into blanks that keep every other byte in its place") {
    const std::string text = "{ \"a//b\": 1, // x\n /* y\n */ \"c\\\"/*\": 2 }";
    CHECK(blank_comments(text) == "{ \"a//b\": 1,     \n     \n    \"c\\\"/*\": 2 }");
}

TEST_CASE("a JSON text cut anywhere is refused, never read as something else") {
    const std::string text =
        R"({"curves": [{"file": "a\u00e9.tfx", "scale": 1.5e-3}], "push_out": true /* end */})";
    REQUIRE(parse_json(text, "t"));
    for (std::size_t n = 0; n < text.size(); ++n) {
        INFO(n);
        CHECK_FALSE(parse_json(text.substr(0, n), "t"));
    }
}
