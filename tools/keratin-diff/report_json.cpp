#include "tools/keratin-diff/report_json.h"

#include "tools/keratin-diff/report_text.h"

#include <nlohmann/json.hpp>

#include <cmath>

namespace keratin::diff {

namespace {

using nlohmann::ordered_json;

// JSON knows no infinity.
ordered_json number(double value) {
    return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json to_json(const Spread& spread) {
    return {{"max", spread.max}, {"p99", spread.p99}, {"rms", spread.rms}};
}

ordered_json to_json(const ListChange& list) {
    ordered_json json{{"a", list.a_count},
                      {"b", list.b_count},
                      {"matched", list.matched},
                      {"added", list.added_count},
                      {"added_first", list.added},
                      {"removed", list.removed_count},
                      {"removed_first", list.removed},
                      {"reordered", list.reordered_count}};
    if (list.reordered_example)
        json["reordered_example"] = {{"id", list.reordered_example->id},
                                     {"a", list.reordered_example->a},
                                     {"b", list.reordered_example->b}};
    return json;
}

ordered_json to_json(const Worst& worst) {
    ordered_json json{{"item", worst.item}};
    if (worst.point) json["point"] = *worst.point;
    json["a"] = worst.a_names.empty() ? ordered_json(worst.a) : ordered_json(worst.a_names);
    json["b"] = worst.b_names.empty() ? ordered_json(worst.b) : ordered_json(worst.b_names);
    if (worst.moved) json["moved"] = *worst.moved;
    return json;
}

ordered_json to_json(const FieldDifference& field, double diagonal) {
    ordered_json json{{"name", field.name},
                      {"unit", field.unit},
                      {"compared", field.compared},
                      {"differing", field.differing},
                      {"not_compared", field.not_compared}};
    if (field.only_in_a) json["only_in"] = "a";
    if (field.only_in_b) json["only_in"] = "b";
    if (field.is_float) {
        json.update(to_json(field.spread));
        if (field.unit == "m" && diagonal > 0)
            json["max_over_diagonal"] = field.spread.max / diagonal;
    }
    if (field.moved) json["moved"] = to_json(*field.moved);
    if (field.shift) json["shift"] = *field.shift;
    if (field.worst) json["worst"] = to_json(*field.worst);
    if (!field.note.empty()) json["note"] = field.note;
    return json;
}

ordered_json to_json(const std::vector<ValueChange>& changes) {
    ordered_json list = ordered_json::array();
    for (const ValueChange& change : changes) {
        ordered_json entry{{"path", change.path}};
        if (!change.a.empty()) entry["a"] = change.a;
        if (!change.b.empty()) entry["b"] = change.b;
        list.push_back(std::move(entry));
    }
    return list;
}

std::string xml_text(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        switch (c) {
            case '&':
                escaped += "&amp;";
                break;
            case '<':
                escaped += "&lt;";
                break;
            case '>':
                escaped += "&gt;";
                break;
            case '"':
                escaped += "&quot;";
                break;
            default:
                // Control characters have no place in XML 1.0.
                escaped += static_cast<unsigned char>(c) < ' ' ? '?' : c;
        }
    }
    return escaped;
}

}  // namespace

ordered_json findings_json(const std::vector<Finding>& findings, const Describe& describe) {
    ordered_json list = ordered_json::array();
    for (const Finding& finding : findings) {
        if (finding.severity == Severity::same) continue;
        list.push_back({{"name", finding.name},
                        {"section", name_of(finding.section)},
                        {"severity", name_of(finding.severity)},
                        {"value", number(finding.value)},
                        {"warn", number(finding.limits.warn)},
                        {"fail", number(finding.limits.fail)},
                        {"text", describe(finding.name)}});
    }
    return list;
}

std::string dumped(const ordered_json& json) {
    // File names may hold bytes that are not UTF-8.
    return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string report_json(const Report& report, const std::vector<Finding>& findings,
                        const std::string& a, const std::string& b, bool passed,
                        const std::string& version) {
    ordered_json json;
    json["program"] = "keratin-diff";
    json["version"] = version;
    json["a"] = a;
    json["b"] = b;
    json["passed"] = passed;
    json["same_bytes"] = report.same_bytes;
    json["diagonal"] = report.diagonal;
    json["findings"] =
        findings_json(findings, [&](const std::string& name) { return describe(report, name); });
    json["strands"] = to_json(report.strands);
    json["guides"] = to_json(report.guides);
    json["stored_vertices"] = to_json(report.vertices);
    json["stored_triangles"] = to_json(report.triangles);
    json["fields"] = ordered_json::array();
    for (const FieldDifference& field : report.fields)
        json["fields"].push_back(to_json(field, report.diagonal));
    json["mesh"] = to_json(report.mesh);
    json["bounds"] = to_json(report.bounds);
    json["settings"] = to_json(report.settings);
    json["recipe"] = to_json(report.recipe);
    json["inputs"] = to_json(report.inputs);
    json["tool_version"] = to_json(report.tool_version);
    return dumped(json);
}

std::string report_junit(const Report& report, const std::vector<Finding>& findings,
                         const std::string& a, const std::string& b, bool strict) {
    return findings_junit(
        findings, [&](const std::string& name) { return describe(report, name); }, a, b, strict);
}

std::string findings_junit(const std::vector<Finding>& findings, const Describe& describe,
                           const std::string& a, const std::string& b, bool strict) {
    std::string cases;
    std::size_t failures = 0;
    for (const Finding& finding : findings) {
        cases += "    <testcase classname=\"keratin-diff." + std::string(name_of(finding.section)) +
                 "\" name=\"" + finding.name + "\"";
        if (finding.severity == Severity::same) {
            cases += "/>\n";
            continue;
        }
        const bool fails = finding.severity == Severity::failure ||
                           (strict && finding.severity == Severity::warning);
        failures += fails;
        const std::string text =
            xml_text(std::string(name_of(finding.severity)) + ": " + describe(finding.name));
        cases += fails ? ">\n      <failure message=\"" + text + "\"/>\n"
                       : ">\n      <system-out>" + text + "</system-out>\n";
        cases += "    </testcase>\n";
    }
    const std::string counts = " tests=\"" + std::to_string(findings.size()) + "\" failures=\"" +
                               std::to_string(failures) + "\"";
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites" + counts +
           ">\n  <testsuite name=\"keratin-diff " + xml_text(a + " " + b) + "\"" + counts + ">\n" +
           cases + "  </testsuite>\n</testsuites>\n";
}

}  // namespace keratin::diff
