// A comparison for programs: one JSON document (schema/report/keratin-diff.schema.json) and a JUnit
// file.
#pragma once

#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/judge.h"

#include <string>
#include <vector>

namespace keratin::diff {

// `a` and `b` are the files as given; passed says whether the program exits with 0.
std::string report_json(const Report& report, const std::vector<Finding>& findings,
                        const std::string& a, const std::string& b, bool passed,
                        const std::string& version);

// One test case a finding; failures, and with `strict` warnings, are JUnit failures.
std::string report_junit(const Report& report, const std::vector<Finding>& findings,
                         const std::string& a, const std::string& b, bool strict);

}  // namespace keratin::diff
