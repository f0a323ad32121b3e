// Numbers as people read them: short, the same on every machine and in every language setting.
#pragma once

#include "schema/asset.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace keratin::diff {

// `digits` significant digits, without trailing zeros: "0.0012", "1.5e-07".
std::string number_text(double value, int digits = 4);

// A length with its unit: "1.2 mm", "350 um", "0.25 m".
std::string length_text(double metres);

// The shortest text that reads back as the same float.
std::string value_text(float value);
std::string value_text(std::uint32_t value);
std::string value_text(const std::string& value);
std::string value_text(const Hash128& value);  // its first 12 digits
std::string value_text(const std::array<float, 3>& value);
std::string value_text(const std::vector<float>& value);
std::string value_text(Attach value);  // as recipes write it

// "(1, 2, 3)"; a single number without brackets. Indices in full, others with 7 digits.
std::string values_text(std::span<const double> values);

}  // namespace keratin::diff
