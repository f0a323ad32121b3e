#include "tools/keratin-diff/report_text.h"

#include "tools/keratin-diff/number_text.h"

#include <algorithm>
#include <cmath>

namespace keratin::diff {

namespace {

std::string plural(std::size_t count, const std::string& one) {
    return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string ids_text(const char* what, const std::vector<std::uint32_t>& ids, std::size_t count) {
    std::string text = std::string(" (") + what + " ";
    for (std::size_t i = 0; i < ids.size(); ++i) text += (i ? ", " : "") + std::to_string(ids[i]);
    return text + (count > ids.size() ? ", ...)" : ")");
}

// "7 -> 8: 1 added (id 99)"
std::string list_text(const ListChange& list, const char* id) {
    std::string text = std::to_string(list.a_count) + " -> " + std::to_string(list.b_count) + ":";
    if (list.added_count > 0)
        text += " " + std::to_string(list.added_count) + " added" +
                ids_text(id, list.added, list.added_count);
    if (list.added_count > 0 && list.removed_count > 0) text += ",";
    if (list.removed_count > 0)
        text += " " + std::to_string(list.removed_count) + " removed" +
                ids_text(id, list.removed, list.removed_count);
    return text;
}

std::string order_text(const ListChange& list, const std::string& what) {
    const ListChange::Place& example = *list.reordered_example;
    return plural(list.reordered_count, what) + (list.reordered_count == 1 ? " stands" : " stand") +
           " at another place, for example id " + std::to_string(example.id) + ": place " +
           std::to_string(example.a) + " -> " + std::to_string(example.b);
}

bool is_length(std::string_view unit) { return unit == "m"; }

std::string amount_text(double value, std::string_view unit) {
    if (is_length(unit)) return length_text(value);
    return number_text(value) + (unit == "1" ? "" : " " + std::string(unit));
}

std::string percent_text(double length, double diagonal) {
    return diagonal > 0 ? " (" + number_text(100 * length / diagonal, 3) + " % of the diagonal)"
                        : "";
}

std::string names_text(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return names.size() == 1 ? text : "(" + text + ")";
}

std::string worst_text(const Worst& worst) {
    std::string text = worst.item;
    if (worst.point) text += " point " + std::to_string(*worst.point);
    const auto side = [](const std::vector<double>& numbers,
                         const std::vector<std::string>& names) {
        return names.empty() ? values_text(numbers) : names_text(names);
    };
    text += ": " + side(worst.a, worst.a_names) + " -> " + side(worst.b, worst.b_names);
    if (worst.moved) text += ", " + length_text(*worst.moved) + " away";
    return text;
}

std::string_view items_of(std::string_view field) {
    for (const FieldDescription& description : kAssetFields) {
        if (description.name != field) continue;
        switch (description.domain) {
            case Domain::tile_edge:
                return "tiles";
            case Domain::lane:
                return "guides";
            case Domain::row:
            case Domain::point:
                return "points";
            case Domain::vertex:
                return "stored vertices";
            case Domain::triangle:
                return "stored triangles";
            case Domain::brick:
                return "bricks";
            case Domain::brick_node:
                return "grid nodes";
            default:
                return "strands";
        }
    }
    return "items";
}

std::string field_text(const FieldDifference& field, double diagonal) {
    if (field.only_in_a) return "only the first asset has it";
    if (field.only_in_b) return "only the second asset has it";
    std::string text = std::to_string(field.differing) + " of " + std::to_string(field.compared) +
                       " " + std::string(items_of(field.name)) + " differ";
    const auto spread = [&](const Spread& s, std::string_view unit) {
        std::string line = "max " + amount_text(s.max, unit);
        if (is_length(unit)) line += percent_text(s.max, diagonal);
        return line + ", p99 " + amount_text(s.p99, unit) + ", RMS " + amount_text(s.rms, unit);
    };
    if (field.is_float) text += "; " + spread(field.spread, field.unit);
    if (field.moved) text += "; roots moved by " + spread(*field.moved, "m");
    if (field.shift) {
        const auto& shift = *field.shift;
        text += "; all by the same shift (" + length_text(shift[0]) + ", " + length_text(shift[1]) +
                ", " + length_text(shift[2]) + ")";
    }
    if (field.worst) text += "; worst: " + worst_text(*field.worst);
    if (!field.note.empty()) text += "; " + field.note;
    return text;
}

std::string changes_text(const std::vector<ValueChange>& changes) {
    std::string text;
    for (std::size_t i = 0; i < std::min(changes.size(), kNamedItems); ++i) {
        const ValueChange& change = changes[i];
        if (!text.empty()) text += "; ";
        text += change.path;
        if (change.a.empty())
            text += " added";
        else if (change.b.empty())
            text += " removed";
        else
            text += ": " + change.a + " -> " + change.b;
    }
    if (changes.size() > kNamedItems)
        text += "; and " + std::to_string(changes.size() - kNamedItems) + " more";
    return text;
}

std::string mesh_text(const Report& report) {
    std::string text = changes_text(report.mesh);
    for (const auto& [list, what] : {std::pair{&report.vertices, "stored vertices "},
                                     std::pair{&report.triangles, "stored triangles "}})
        if (list->added_count + list->removed_count > 0)
            text += (text.empty() ? "" : "; ") + (what + list_text(*list, "number"));
    return text;
}

}  // namespace

std::string describe(const Report& report, const std::string& name) {
    for (const FieldDifference& field : report.fields)
        if (field.name == name) return field.differs() ? field_text(field, report.diagonal) : "";
    const auto list = [](const ListChange& change) {
        return change.added_count + change.removed_count > 0 ? list_text(change, "id") : "";
    };
    const auto order = [](const ListChange& change, const char* what) {
        return change.reordered_example ? order_text(change, what) : "";
    };
    if (name == "strands") return list(report.strands);
    if (name == "strand_order") return order(report.strands, "strand");
    if (name == "guides") return list(report.guides);
    if (name == "guide_order") return order(report.guides, "guide");
    if (name == "mesh") return mesh_text(report);
    if (name == "bounds") return changes_text(report.bounds);
    if (name == "settings") return changes_text(report.settings);
    if (name == "recipe") return changes_text(report.recipe);
    if (name == "inputs") return changes_text(report.inputs);
    if (name == "tool_version") return changes_text(report.tool_version);
    return "";
}

std::string report_text(const Report& report, const std::vector<Finding>& findings) {
    if (report.same_bytes) return "the assets are equal, byte for byte\n";
    const std::string text =
        findings_text(findings, [&](const std::string& name) { return describe(report, name); });
    return text.empty() ? "the assets mean the same, though not every byte is equal\n" : text;
}

std::string findings_text(const std::vector<Finding>& findings, const Describe& describe) {
    std::string text;
    std::size_t failures = 0, warnings = 0, tolerated = 0;
    for (const Finding& finding : findings) {
        if (finding.severity == Severity::same) continue;
        failures += finding.severity == Severity::failure;
        warnings += finding.severity == Severity::warning;
        tolerated += finding.severity == Severity::tolerated;
        std::string head(name_of(finding.severity));
        constexpr std::size_t kColumn = 10;
        head.resize(std::max(head.size() + 1, kColumn), ' ');
        text += head + finding.name + ": " + describe(finding.name);
        if (finding.severity == Severity::tolerated)
            text += "; allowed: " +
                    number_text(std::isinf(finding.limits.fail) ? finding.limits.warn
                                                                : finding.limits.fail) +
                    (finding.unit.empty() || finding.unit == "1" ? ""
                                                                 : " " + std::string(finding.unit));
        text += "\n";
    }
    if (text.empty()) return text;
    return text + plural(failures, "failure") + ", " + plural(warnings, "warning") + ", " +
           std::to_string(tolerated) + " tolerated\n";
}

}  // namespace keratin::diff
