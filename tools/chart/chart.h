// Lines over two axes as an SVG picture, for reports and readmes. The same chart gives the same
// bytes on every machine.
#pragma once

#include "schema/result.h"

#include <string>
#include <vector>

namespace keratin::chart {

enum class Scale { linear, logarithmic };

struct Axis {
    std::string label;  // what it shows and its unit; UTF-8
    Scale scale = Scale::linear;
};

// Points joined in their order. A zero has no place on a logarithmic y axis: the line stops there
// and an arrowhead at the lower edge marks it, those of several lines at one x above each other.
struct Line {
    std::string name;          // in the legend; UTF-8
    std::vector<double> x, y;  // of the same length; may be empty
};

constexpr int kLeastSide = 200, kLargestSide = 8000;  // pixels

struct Chart {
    std::string title;  // above the chart, and what a screen reader says
    Axis x, y;
    std::vector<Line> lines;
    int width = 720, height = 440;  // pixels, kLeastSide..kLargestSide
};

// Largest magnitude of a value that can be drawn.
constexpr double kLargestValue = 1e300;

// The axes reach from tick to tick around all values; a logarithmic one over whole decades.
// Errors: usage for a width or height out of range; input when there is no point to draw, and,
// naming line and point, when a value is not finite, beyond kLargestValue, or has no place on a
// logarithmic axis (x <= 0, y < 0).
Result<std::string> to_svg(const Chart& chart);

}  // namespace keratin::chart
