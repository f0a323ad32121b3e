// Which differences count. Everything that can differ has a name: each field of schema/fields.h,
// and strands, strand_order, guides, guide_order, mesh, bounds, settings, recipe, inputs,
// tool_version. Each name has a value (FieldDifference::value(); the number of changes for the
// others) and two limits.
#pragma once

#include "schema/result.h"
#include "tools/keratin-diff/compare.h"

#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace keratin::diff {

enum class Severity {
    same,
    tolerated,  // differs within both limits
    warning,    // beyond the warning limit
    failure     // beyond the failure limit
};
std::string_view name_of(Severity severity);

enum class Section { data, settings, origin };
std::string_view name_of(Section section);

struct Limits {
    static constexpr double kNone = std::numeric_limits<double>::infinity();
    double warn = kNone, fail = kNone;
};

struct Finding {
    std::string name;
    Section section = Section::data;
    std::string_view unit;  // of value; "" for counts
    double value = 0;       // infinite for a field that only one asset has
    Limits limits;
    Severity severity = Severity::same;
};

// Something that can differ, and the unit of its value: "" for counts.
struct Subject {
    std::string name;
    Section section = Section::data;
    std::string_view unit;
};

// What can differ between two assets, in the order of findings.
std::vector<Subject> asset_subjects();
// Their names.
std::vector<std::string> finding_names();

// Limits as asked for on the command line. Without any, every difference in data and settings
// fails, and one in where the asset came from (recipe, inputs, tool_version) warns. A name with
// only a warning limit never fails; one with only a failure limit never warns.
class Tolerances {
  public:
    explicit Tolerances(std::vector<Subject> subjects = asset_subjects());

    // "FIELD=V": FIELD is a name or a pattern with *, V a number in the name's unit; lengths may
    // also be written as 0.5mm or 20um. What is set later holds. Errors (usage): no such name, or
    // not a number >= 0.
    Result<void> set_warn(const std::string& text);
    Result<void> set_fail(const std::string& text);

    // The finding on subject i, given its value.
    Finding judge(std::size_t i, double value) const;

  private:
    struct Setting;
    Result<Setting> parse(const std::string& text) const;
    std::vector<Subject> subjects_;
    std::vector<Limits> limits_;  // as subjects_
    std::vector<bool> is_set_;
};

// One finding a name, in the order of asset_subjects(), also where nothing differs; of tolerances
// made for them.
std::vector<Finding> judge(const Report& report, const Tolerances& tolerances);

}  // namespace keratin::diff
