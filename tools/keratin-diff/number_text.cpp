#include "tools/keratin-diff/number_text.h"

#include "schema/file_hash.h"

#include <charconv>
#include <cmath>

namespace keratin::diff {

namespace {

constexpr std::size_t kHashDigits = 12;
// Enough to tell floats apart that matter to people; JSON has them all.
constexpr int kFloatDigits = 7;

template <class Value, class... Format>
std::string to_text(Value value, Format... format) {
    std::array<char, 64> buffer{};
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format...);
    return {buffer.data(), end.ptr};
}

template <class List, class Text>
std::string bracketed(const List& values, Text&& text) {
    if (values.size() == 1) return text(values[0]);
    std::string all = "(";
    for (std::size_t i = 0; i < values.size(); ++i) all += (i ? ", " : "") + text(values[i]);
    return all + ")";
}

}  // namespace

std::string number_text(double value, int digits) {
    return to_text(value, std::chars_format::general, digits);
}

std::string length_text(double metres) {
    constexpr double kMetre = 0.1, kMillimetre = 1e-4;
    if (metres == 0) return "0 mm";
    if (std::abs(metres) >= kMetre) return number_text(metres) + " m";
    if (std::abs(metres) >= kMillimetre) return number_text(metres * 1e3) + " mm";
    return number_text(metres * 1e6) + " um";
}

std::string value_text(float value) { return to_text(value); }
std::string value_text(std::uint32_t value) { return std::to_string(value); }
std::string value_text(const std::string& value) { return value; }
std::string value_text(const Hash128& value) { return to_string(value).substr(0, kHashDigits); }
std::string value_text(const std::array<float, 3>& value) {
    return bracketed(value, [](float v) { return value_text(v); });
}
std::string value_text(const std::vector<float>& value) {
    return bracketed(value, [](float v) { return value_text(v); });
}

std::string value_text(Attach value) {
    switch (value) {
        case Attach::bone:
            return "bone";
        case Attach::all:
            return "all";
        case Attach::triangle:
            return "triangle";
    }
    return "";
}

std::string values_text(std::span<const double> values) {
    constexpr double kLargestIndex = 4294967295.0;
    return bracketed(values, [](double v) {
        const bool is_index = v >= 0 && v <= kLargestIndex && v == std::floor(v);
        return is_index ? std::to_string(static_cast<std::uint32_t>(v))
                        : number_text(v, kFloatDigits);
    });
}

}  // namespace keratin::diff
