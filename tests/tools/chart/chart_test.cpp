#include "tools/chart/chart.h"

#include "tests/xml.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

using namespace keratin;
using namespace keratin::chart;
using test::read_xml;
using test::XmlElement;

namespace {

constexpr double kRounding = 0.011;  // places are written with two decimals

Chart decades() {
    Chart chart;
    chart.title = "a < b & \"c\"";
    chart.x.label = "iteration";
    chart.y = {"change", Scale::logarithmic};
    chart.lines = {{"dv", {1, 2, 3}, {1, 1e-2, 1e-4}}, {"dr", {1, 3}, {1e-6, 1e-8}}};
    return chart;
}

XmlElement drawn(const Chart& chart) {
    const auto svg = to_svg(chart);
    REQUIRE(svg);
    return read_xml(*svg);
}

// The place of the label that reads `text`, along the axis that it belongs to.
double label(const XmlElement& svg, const std::string& text, const char* along) {
    for (const XmlElement* t : svg.all("text"))
        if (t->text == text) return t->number(along);
    FAIL("no label " << text);
    return 0;
}

std::string message(const Chart& chart) {
    const auto svg = to_svg(chart);
    REQUIRE_FALSE(svg);
    return to_string(svg.error());
}

}  // namespace

TEST_CASE("a chart is well-formed SVG of the size asked for, whatever its texts hold") {
    Chart chart = decades();
    chart.width = 500;
    chart.lines[0].name = "<&>\"\n\x01";
    const XmlElement svg = drawn(chart);
    CHECK(svg.name == "svg");
    CHECK(svg.attributes.at("xmlns") == "http://www.w3.org/2000/svg");
    CHECK(svg.number("width") == 500);
    CHECK(svg.attributes.at("viewBox") == "0 0 500 440");
    REQUIRE(svg.all("title").size() == 1);
    CHECK(svg.all("title")[0]->text == chart.title);
    label(svg, "<&>\"  ", "x");
    label(svg, "iteration", "x");
}

TEST_CASE("values land between the labels of their axes") {
    const XmlElement svg = drawn(decades());
    const auto dots = svg.all("circle");
    REQUIRE(dots.size() == 5);
    const double decade = (label(svg, "10-8", "y") - label(svg, "10-2", "y")) / 6;
    CHECK(decade > 30);
    // Labels stand a third of a letter's height, 13 / 3 pixels, below what they name.
    const double one = label(svg, "10-2", "y") - 13.0 / 3 - 2 * decade;
    const double exponents[] = {0, -2, -4, -6, -8};
    for (int i = 0; i < 5; ++i) {
        CAPTURE(i);
        CHECK(std::abs(dots[i]->number("cy") - one + exponents[i] * decade) < kRounding);
    }
    CHECK(label(svg, "1", "x") < label(svg, "2", "x"));
    CHECK(std::abs(dots[1]->number("cx") - label(svg, "2", "x")) < kRounding);
    CHECK(std::abs(dots[4]->number("cx") - label(svg, "3", "x")) < kRounding);
}

TEST_CASE("a linear axis has round ticks around its values, few enough to be read") {
    for (const auto& [low, high] : {std::pair{0.0, 1.0},
                                    {-3e-7, 8e-7},
                                    {17.0, 17.0},
                                    {0.0, 0.0},
                                    {-1e300, 1e300},
                                    {1e9, 1e9 + 1},
                                    {0.2, 0.30000001}}) {
        CAPTURE(low, high);
        Chart chart;
        chart.lines = {{"line", {1, 2}, {low, high}}};
        const XmlElement svg = drawn(chart);
        const auto grid = svg.all("g")[0]->all("line");
        CHECK(grid.size() <= 2 * 11);
        double top = 1e9, bottom = 0;
        for (const XmlElement* line : grid) {
            top = std::min(top, line->number("y1"));
            bottom = std::max(bottom, line->number("y2"));
        }
        for (const XmlElement* dot : svg.all("circle")) {
            CHECK(dot->number("cy") >= top - kRounding);
            CHECK(dot->number("cy") <= bottom + kRounding);
        }
    }
}

TEST_CASE("zero on a logarithmic axis breaks the line and is an arrowhead at the lower edge") {
    Chart chart = decades();
    chart.lines = {{"dv", {1, 2, 3, 4, 5}, {1, 1e-3, 0, 1e-2, 0}}};
    const XmlElement svg = drawn(chart);
    CHECK(svg.all("circle").size() == 3);
    const auto paths = svg.all("path");
    REQUIRE(paths.size() == 3);
    CHECK(std::count(paths[0]->attributes.at("d").begin(), paths[0]->attributes.at("d").end(),
                     'M') == 2);
    // Its point lies on the x axis, whose line is the second of the dark ones.
    const double edge = svg.all("g")[1]->all("line")[1]->number("y1");
    for (int i : {1, 2}) {
        const std::string& d = paths[i]->attributes.at("d");
        CHECK(std::abs(std::stod(d.substr(d.rfind(' '))) - edge) < kRounding);
    }
    chart.lines = {{"dv", {1, 2}, {0, 0}}, {"dr", {2}, {0}}};
    const XmlElement zeros = drawn(chart);
    CHECK(zeros.all("circle").empty());
    REQUIRE(zeros.all("path").size() == 3);
    CHECK(zeros.all("path")[1]->attributes.at("d") != zeros.all("path")[2]->attributes.at("d"));
}

TEST_CASE("a line of many points has no dots, but for one that stands alone") {
    Chart chart = decades();
    Line line{"long", {}, {}};
    for (int i = 0; i < 100; ++i) {
        line.x.push_back(i);
        line.y.push_back(i == 40 || i == 42 ? 0 : 1 + i);
    }
    chart.lines = {line};
    const auto dots = drawn(chart).all("circle");
    CHECK(dots.size() == 1);
}

TEST_CASE("a legend that is too wide goes on in the next row, above the chart") {
    Chart chart = decades();
    chart.width = 300;
    for (int i = 0; i < 5; ++i) chart.lines.push_back({"a name of some length", {1}, {1}});
    const XmlElement svg = drawn(chart);
    for (const XmlElement* t : svg.all("text"))
        if (t->text == "a name of some length") {
            CHECK(t->number("x") < 300);
            CHECK(t->number("y") < svg.all("circle")[0]->number("cy"));
        }
}

TEST_CASE("the same chart gives the same bytes") {
    CHECK(*to_svg(decades()) == *to_svg(decades()));
    Chart chart;
    chart.lines = {{"a", {0, 1}, {0, 0.5}}};
    // A golden text: what changes it changes every picture in the repository.
    const std::string svg = *to_svg(chart);
    std::uint64_t hash = 14695981039346656037u;
    for (const unsigned char c : svg) hash = (hash ^ c) * 1099511628211u;
    CAPTURE(svg);
    CHECK(hash == 0x671ca928093a42ef);
}

TEST_CASE("what cannot be drawn is refused by line and point") {
    Chart chart = decades();
    chart.lines = {};
    CHECK(message(chart).find("nothing to draw") != std::string::npos);
    chart.lines = {{"dv", {}, {}}};
    CHECK(message(chart).find("nothing to draw") != std::string::npos);
    chart.lines = {{"dv", {1, 2}, {1, -1}}};
    CHECK(message(chart) ==
          "dv: point 1: y = -1 has no place on a logarithmic axis, only what is >= 0");
    for (const double wrong : {std::nan(""), std::numeric_limits<double>::infinity(), 1e301}) {
        chart.lines = {{"dv", {1, wrong}, {1, 1}}};
        CHECK(message(chart).find("dv: point 1: x = ") == 0);
    }
    chart.lines = {{"dv", {0}, {1}}};
    CHECK(drawn(chart).all("circle").size() == 1);
    chart.x.scale = Scale::logarithmic;
    CHECK(message(chart).find("only what is > 0") != std::string::npos);
    chart.lines = {{"dv", {1}, {1}}};
    chart.height = kLeastSide - 1;
    CHECK(message(chart).find("199 pixels") != std::string::npos);
}
