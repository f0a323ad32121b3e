#include "tools/chart/chart.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

namespace keratin::chart {
namespace {

// Okabe and Ito's colours, told apart by colour-blind readers, the darker ones first.
constexpr std::array<const char*, 6> kColors{"#0072b2", "#d55e00", "#009e73",
                                             "#cc79a7", "#e69f00", "#56b4e9"};
constexpr double kFont = 13, kSmallFont = 9, kTitleFont = 16;  // pixels
constexpr double kLetter = 0.56;  // width of a letter over its height, about
constexpr double kLeft = 68, kRight = 20, kBelow = 50, kTitleHeight = 34, kLegendRow = 20;
constexpr double kSwatch = 24, kLegendGap = 18, kDot = 2.5, kArrow = 5;
constexpr int kMostTicks = 9;
constexpr std::size_t kMostDots = 60;  // points of a line that are marked one by one

// Text of a number that no locale changes.
std::string pixels(double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, 2);
    return std::string(text, end.ptr);
}

std::string general(double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6);
    return std::string(text, end.ptr);
}

// XML has no way to write control characters: they become spaces.
std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '&') {
            out += "&amp;";
        } else if (c == '<') {
            out += "&lt;";
        } else if (c == '>') {
            out += "&gt;";
        } else if (c == '"') {
            out += "&quot;";
        } else {
            out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
        }
    }
    return out;
}

double text_width(std::string_view text) {
    const auto letters =
        std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; });
    return double(letters) * kLetter * kFont;
}

struct Tick {
    double value;       // as placed: the exponent on a logarithmic axis
    std::string label;  // SVG text
};

// An axis with its range: values are placed by themselves or by their logarithm.
struct Range {
    Scale scale;
    double low, high;
    std::vector<Tick> ticks;

    double share(double value) const {
        const double placed = scale == Scale::logarithmic ? std::log10(value) : value;
        return (placed - low) / (high - low);
    }
};

// The least of 1, 2, 5, ... times a power of ten that is not below `least`.
double round_step(double least) {
    const double power = std::pow(10, std::floor(std::log10(least)));
    for (const double digit : {1.0, 2.0, 5.0})
        if (digit * power >= least * (1 - 1e-9)) return digit * power;
    return 10 * power;
}

std::string power_of_ten(int exponent) {
    if (exponent == 0) return "1";
    return "10<tspan dy=\"-5\" font-size=\"" + general(kSmallFont) + "\">" +
           std::to_string(exponent) + "</tspan>";
}

Range logarithmic_range(double low, double high) {
    int first = int(std::floor(std::log10(low))), last = int(std::ceil(std::log10(high)));
    if (first == last) {
        --first;
        ++last;
    }
    int step = 1;
    for (const int wider : {2, 3, 5, 10, 20, 50, 100})
        if ((last - first) / step >= kMostTicks) step = wider;
    Range range{Scale::logarithmic, double(first), double(last), {}};
    for (int e = first; e <= last; ++e)
        if (e % step == 0) range.ticks.push_back({double(e), power_of_ten(e)});
    return range;
}

Range linear_range(double low, double high) {
    const double size = std::max(std::abs(low), std::abs(high));
    if (high - low <= 1e-9 * size) {
        const double half = size > 0 ? size / 2 : 1;
        low -= half;
        high += half;
    }
    const double step = round_step((high - low) / (kMostTicks - 1));
    const double first = std::floor(low / step + 1e-9), last = std::ceil(high / step - 1e-9);
    Range range{Scale::linear, first * step, last * step, {}};
    for (double k = first; k <= last; ++k) range.ticks.push_back({k * step, general(k * step)});
    return range;
}

// Range of the values that have a place; 1 where there are only zeros on a logarithmic axis.
Range range_of(const Chart& chart, const Axis& axis, std::vector<double> Line::*values) {
    const bool logarithmic = axis.scale == Scale::logarithmic;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Line& line : chart.lines)
        for (const double v : line.*values)
            if (!logarithmic || v > 0) {
                low = std::min(low, v);
                high = std::max(high, v);
            }
    if (low > high) low = high = 1;
    return logarithmic ? logarithmic_range(low, high) : linear_range(low, high);
}

Result<void> check(const Chart& chart) {
    for (const int side : {chart.width, chart.height})
        if (side < kLeastSide || side > kLargestSide)
            return Error{ErrorCode::usage, "chart",
                         "a side of " + std::to_string(side) + " pixels is not within " +
                             std::to_string(kLeastSide) + " to " + std::to_string(kLargestSide)};
    bool any = false;
    for (const Line& line : chart.lines) {
        assert(line.x.size() == line.y.size());
        for (std::size_t i = 0; i < line.x.size(); ++i) {
            any = true;
            const auto wrong = [&](const char* name, double value, const char* what) {
                return Error{
                    ErrorCode::input, line.name,
                    "point " + std::to_string(i) + ": " + name + " = " + general(value) + what};
            };
            const std::pair<const char*, double> values[] = {{"x", line.x[i]}, {"y", line.y[i]}};
            for (const auto& [name, value] : values)
                if (!(std::abs(value) <= kLargestValue))
                    return wrong(name, value, " cannot be drawn, only up to 1e300");
            if (chart.x.scale == Scale::logarithmic && line.x[i] <= 0)
                return wrong("x", line.x[i],
                             " has no place on a logarithmic axis, only what is > 0");
            if (chart.y.scale == Scale::logarithmic && line.y[i] < 0)
                return wrong("y", line.y[i],
                             " has no place on a logarithmic axis, only what is >= 0");
        }
    }
    if (!any) return Error{ErrorCode::input, "chart", "holds no point: there is nothing to draw"};
    return {};
}

struct Box {
    double left, top, right, bottom;
};

// Collects elements; every attribute that repeats is set once on their group.
class Svg {
  public:
    void line(double x1, double y1, double x2, double y2) {
        out += "<line x1=\"" + pixels(x1) + "\" y1=\"" + pixels(y1) + "\" x2=\"" + pixels(x2) +
               "\" y2=\"" + pixels(y2) + "\"/>\n";
    }
    // `content` is SVG already.
    void text(double x, double y, const std::string& attributes, const std::string& content) {
        if (content.empty()) return;
        out += "<text x=\"" + pixels(x) + "\" y=\"" + pixels(y) + "\"" + attributes + ">" +
               content + "</text>\n";
    }
    void dot(double x, double y) {
        out += "<circle cx=\"" + pixels(x) + "\" cy=\"" + pixels(y) + "\" r=\"" + pixels(kDot) +
               "\"/>\n";
    }
    void arrow_down(double x, double bottom) {
        out += "<path d=\"M" + pixels(x - kArrow) + " " + pixels(bottom - 2 * kArrow) + "h" +
               pixels(2 * kArrow) + "L" + pixels(x) + " " + pixels(bottom) + "z\"/>\n";
    }
    std::string out;
};

// Places of the legend's entries, row by row; x of the swatch and row number.
std::vector<std::pair<double, int>> legend_places(const Chart& chart) {
    std::vector<std::pair<double, int>> places;
    double x = kLeft;
    int row = 0;
    for (const Line& line : chart.lines) {
        const double width = kSwatch + text_width(line.name) + kLegendGap;
        if (x > kLeft && x + width > chart.width) {
            x = kLeft;
            ++row;
        }
        places.push_back({x, row});
        x += width;
    }
    return places;
}

void draw_axes(const Chart& chart, const Range& x, const Range& y, const Box& box, Svg& svg) {
    svg.out += "<g stroke=\"#dddddd\">\n";
    const auto across = [&](const Tick& t) {
        return box.left + (t.value - x.low) / (x.high - x.low) * (box.right - box.left);
    };
    const auto up = [&](const Tick& t) {
        return box.bottom - (t.value - y.low) / (y.high - y.low) * (box.bottom - box.top);
    };
    for (const Tick& t : x.ticks) svg.line(across(t), box.top, across(t), box.bottom);
    for (const Tick& t : y.ticks) svg.line(box.left, up(t), box.right, up(t));
    svg.out += "</g>\n<g stroke=\"#333333\">\n";
    svg.line(box.left, box.top, box.left, box.bottom);
    svg.line(box.left, box.bottom, box.right, box.bottom);
    svg.out += "</g>\n<g text-anchor=\"middle\">\n";
    for (const Tick& t : x.ticks) svg.text(across(t), box.bottom + 18, "", t.label);
    svg.text((box.left + box.right) / 2, chart.height - 10, "", escaped(chart.x.label));
    const double middle = (box.top + box.bottom) / 2;
    svg.text(16, middle, " transform=\"rotate(-90 16 " + pixels(middle) + ")\"",
             escaped(chart.y.label));
    svg.out += "</g>\n<g text-anchor=\"end\">\n";
    for (const Tick& t : y.ticks) svg.text(box.left - 8, up(t) + kFont / 3, "", t.label);
    svg.out += "</g>\n";
}

// How many of the lines before this one have a zero at x: their arrowheads are already there.
int zeros_before(const Chart& chart, std::size_t line, double x) {
    int count = 0;
    for (std::size_t k = 0; k < line; ++k) {
        const Line& other = chart.lines[k];
        for (std::size_t i = 0; i < other.x.size(); ++i)
            if (other.x[i] == x && other.y[i] == 0) {
                ++count;
                break;
            }
    }
    return count;
}

void draw_line(const Chart& chart, std::size_t number, const Range& x, const Range& y,
               const Box& box, Svg& svg) {
    const Line& line = chart.lines[number];
    const auto across = [&](std::size_t i) {
        return box.left + x.share(line.x[i]) * (box.right - box.left);
    };
    const auto up = [&](std::size_t i) {
        return box.bottom - y.share(line.y[i]) * (box.bottom - box.top);
    };
    const auto placed = [&](std::size_t i) { return y.scale == Scale::linear || line.y[i] > 0; };
    std::string path;
    for (std::size_t i = 0; i < line.x.size(); ++i)
        if (placed(i))
            path += (i > 0 && placed(i - 1) ? "L" : "M") + pixels(across(i)) + " " + pixels(up(i));
    if (!path.empty()) svg.out += "<path fill=\"none\" d=\"" + path + "\"/>\n";
    for (std::size_t i = 0; i < line.x.size(); ++i) {
        if (!placed(i))
            svg.arrow_down(across(i),
                           box.bottom - 2 * kArrow * zeros_before(chart, number, line.x[i]));
        // A point by itself would not be seen without its dot.
        const bool alone = (i == 0 || !placed(i - 1)) && (i + 1 == line.x.size() || !placed(i + 1));
        if (placed(i) && (alone || line.x.size() <= kMostDots)) svg.dot(across(i), up(i));
    }
}

}  // namespace

Result<std::string> to_svg(const Chart& chart) {
    if (const auto ok = check(chart); !ok) return ok.error();
    const Range x = range_of(chart, chart.x, &Line::x), y = range_of(chart, chart.y, &Line::y);
    const auto places = legend_places(chart);
    const double legend_top = chart.title.empty() ? 8 : kTitleHeight;
    const Box box{kLeft, legend_top + kLegendRow * (places.back().second + 1) + 8,
                  chart.width - kRight, chart.height - kBelow};

    Svg svg;
    const std::string width = std::to_string(chart.width), height = std::to_string(chart.height);
    svg.out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" +
              height + "\" viewBox=\"0 0 " + width + " " + height +
              "\" role=\"img\" font-family=\"sans-serif\" font-size=\"" + general(kFont) +
              "\" fill=\"#333333\">\n";
    if (!chart.title.empty()) svg.out += "<title>" + escaped(chart.title) + "</title>\n";
    svg.out += "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
    svg.text(kLeft, 23, " font-size=\"" + general(kTitleFont) + "\"", escaped(chart.title));
    draw_axes(chart, x, y, box, svg);
    for (std::size_t i = 0; i < chart.lines.size(); ++i) {
        const std::string color = kColors[i % kColors.size()];
        const double left = places[i].first, row = legend_top + kLegendRow * places[i].second + 10;
        svg.out += "<g stroke=\"" + color + "\" fill=\"" + color +
                   "\" stroke-width=\"1.5\" stroke-linejoin=\"round\">\n";
        svg.line(left, row, left + kSwatch - 6, row);
        draw_line(chart, i, x, y, box, svg);
        svg.out += "</g>\n";
        svg.text(left + kSwatch, row + kFont / 3, "", escaped(chart.lines[i].name));
    }
    svg.out += "</svg>\n";
    return svg.out;
}

}  // namespace keratin::chart
