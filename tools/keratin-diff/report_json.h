// A comparison for programs: one JSON document (schema/report/keratin-diff.schema.json) and a JUnit
// file.
#pragma once

#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/judge.h"
#include "tools/keratin-diff/report_text.h"

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace keratin::diff {

// `a` and `b` are the files as given; passed says whether the program exits with 0.
std::string report_json(const Report& report, const std::vector<Finding>& findings,
                        const std::string& a, const std::string& b, bool passed,
                        const std::string& version);

// One test case a finding; failures, and with `strict` warnings, are JUnit failures.
std::string findings_junit(const std::vector<Finding>& findings, const Describe& describe,
                           const std::string& a, const std::string& b, bool strict);
std::string report_junit(const Report& report, const std::vector<Finding>& findings,
                         const std::string& a, const std::string& b, bool strict);

// The findings that differ, as the list `findings` of a document.
nlohmann::ordered_json findings_json(const std::vector<Finding>& findings,
                                     const Describe& describe);
// The document as text, with what is no UTF-8 (names of files) replaced.
std::string dumped(const nlohmann::ordered_json& json);

}  // namespace keratin::diff
