// What keratin-report prints: a table for people, JSON (schema/report/keratin-report.schema.json) and
// JUnit for machines.
#pragma once

#include "tools/keratin-report/case.h"

#include <string>
#include <vector>

namespace keratin::report {

std::string outcome_text(const Outcome& outcome);
// "12 passed, 1 failed, 2 not applicable"
std::string summary_text(const std::vector<Outcome>& outcomes);
std::string outcomes_json(const std::string& command, const std::string& solver, const std::vector<Outcome>& outcomes);
std::string outcomes_junit(const std::string& command, const std::vector<Outcome>& outcomes);

// False when any case that was run failed.
bool all_passed(const std::vector<Outcome>& outcomes);

}  // namespace keratin::report
