// A comparison as text for people.
#pragma once

#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/judge.h"

#include <functional>
#include <string>
#include <vector>

namespace keratin::diff {

// One line that says what changed under this name, without the name itself:
// "12 of 28 points differ; max 1.2 mm (0.6 % of the diagonal), p99 1.1 mm, RMS 0.3 mm; worst:
// strand 3 point 2: (0.01, 0.02, 0) -> (0.0112, 0.02, 0)". Empty where nothing differs.
std::string describe(const Report& report, const std::string& name);

// What changed under a name, in one line; empty where nothing differs.
using Describe = std::function<std::string(const std::string& name)>;

// A line a finding that differs: severity, name, description; then the totals. Empty
// when nothing differs.
std::string findings_text(const std::vector<Finding>& findings, const Describe& describe);

// Only what differs, a line a finding: severity, name, description; then the totals. Lines end in
// '\n'. Depends on the two assets and the limits alone, not on where the files are.
std::string report_text(const Report& report, const std::vector<Finding>& findings);

}  // namespace keratin::diff
