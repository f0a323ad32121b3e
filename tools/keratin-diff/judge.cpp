#include "tools/keratin-diff/judge.h"

#include <charconv>
#include <cmath>

namespace keratin::diff {

namespace {

// Names beside the fields, before and after them.
constexpr std::string_view kBefore[] = {"strands", "strand_order", "guides", "guide_order", "mesh"};
struct Other {
    std::string_view name;
    Section section;
};
constexpr Other kAfter[] = {{"bounds", Section::data},
                            {"settings", Section::settings},
                            {"recipe", Section::origin},
                            {"inputs", Section::origin},
                            {"tool_version", Section::origin}};

// '*' stands for any characters.
bool matches(std::string_view pattern, std::string_view name) {
    if (pattern.empty()) return name.empty();
    if (pattern[0] == '*')
        return matches(pattern.substr(1), name) ||
               (!name.empty() && matches(pattern, name.substr(1)));
    return !name.empty() && pattern[0] == name[0] && matches(pattern.substr(1), name.substr(1));
}

const FieldDescription* find_description(std::string_view name) {
    for (const FieldDescription& field : kAssetFields)
        if (field.name == name) return &field;
    return nullptr;
}

Section section_of(std::string_view name) {
    for (const Other& other : kAfter)
        if (other.name == name) return other.section;
    return Section::data;
}

std::size_t changes(const ListChange& list) { return list.added_count + list.removed_count; }

double value_of(const Report& report, std::string_view name) {
    for (const FieldDifference& field : report.fields)
        if (field.name == name) return field.value();
    const auto count = [&]() -> std::size_t {
        if (name == "strands") return changes(report.strands);
        if (name == "strand_order") return report.strands.reordered_count;
        if (name == "guides") return changes(report.guides);
        if (name == "guide_order") return report.guides.reordered_count;
        if (name == "mesh")
            return report.mesh.size() + changes(report.vertices) + changes(report.triangles);
        if (name == "bounds") return report.bounds.size();
        if (name == "settings") return report.settings.size();
        if (name == "recipe") return report.recipe.size();
        if (name == "inputs") return report.inputs.size();
        return report.tool_version.size();
    };
    return double(count());
}

}  // namespace

std::string_view name_of(Severity severity) {
    switch (severity) {
        case Severity::same:
            return "same";
        case Severity::tolerated:
            return "tolerated";
        case Severity::warning:
            return "warning";
        case Severity::failure:
            return "failure";
    }
    return "";
}

std::string_view name_of(Section section) {
    switch (section) {
        case Section::data:
            return "data";
        case Section::settings:
            return "settings";
        case Section::origin:
            return "origin";
    }
    return "";
}

std::vector<Subject> asset_subjects() {
    std::vector<Subject> subjects;
    for (const std::string& name : finding_names()) {
        const FieldDescription* field = find_description(name);
        subjects.push_back({name, section_of(name), field && field->is_float ? field->unit : ""});
    }
    return subjects;
}

std::vector<std::string> finding_names() {
    std::vector<std::string> names(std::begin(kBefore), std::end(kBefore));
    for (const FieldDescription& field : kAssetFields) names.emplace_back(field.name);
    for (const Other& other : kAfter) names.emplace_back(other.name);
    return names;
}

Tolerances::Tolerances(std::vector<Subject> subjects) : subjects_(std::move(subjects)) {
    for (const Subject& subject : subjects_) {
        Limits limits;
        (subject.section == Section::origin ? limits.warn : limits.fail) = 0;
        limits_.push_back(limits);
    }
    is_set_.assign(limits_.size(), false);
}

struct Tolerances::Setting {
    std::vector<std::size_t> names;
    double value = 0;
};

Result<Tolerances::Setting> Tolerances::parse(const std::string& text) const {
    const auto wrong = [&](std::string message) {
        return Error{ErrorCode::usage, text, std::move(message)};
    };
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos)
        return wrong("a tolerance is FIELD=V, for example strand_position=0.5mm");
    const std::string_view pattern = std::string_view(text).substr(0, equals);
    Setting setting;
    bool lengths = true;
    for (std::size_t i = 0; i < subjects_.size(); ++i)
        if (matches(pattern, subjects_[i].name)) {
            setting.names.push_back(i);
            lengths = lengths && subjects_[i].unit == "m";
        }
    if (setting.names.empty()) {
        std::string known;
        for (const Subject& subject : subjects_)
            known += (known.empty() ? "" : ", ") + subject.name;
        return wrong("no field is called \"" + std::string(pattern) + "\"; there are " + known);
    }
    const char* begin = text.data() + equals + 1;
    const char* end = text.data() + text.size();
    const auto [rest, failed] = std::from_chars(begin, end, setting.value);
    if (failed != std::errc() || !std::isfinite(setting.value) || setting.value < 0)
        return wrong("\"" + std::string(begin, end) + "\" is not a number >= 0");
    const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
    constexpr double kMillimetre = 1e-3, kMicrometre = 1e-6;
    if (!unit.empty() && !lengths)
        return wrong("\"" + std::string(unit) + "\" after the number; " + std::string(pattern) +
                     " is no length and takes a plain number");
    if (unit == "mm")
        setting.value *= kMillimetre;
    else if (unit == "um")
        setting.value *= kMicrometre;
    else if (!unit.empty() && unit != "m")
        return wrong("\"" + std::string(unit) + "\" is no unit of length; use m, mm or um");
    return setting;
}

Result<void> Tolerances::set_warn(const std::string& text) {
    const auto setting = parse(text);
    if (!setting) return setting.error();
    for (const std::size_t name : setting->names) {
        if (!is_set_[name]) limits_[name] = {};
        limits_[name].warn = setting->value;
        is_set_[name] = true;
    }
    return {};
}

Result<void> Tolerances::set_fail(const std::string& text) {
    const auto setting = parse(text);
    if (!setting) return setting.error();
    for (const std::size_t name : setting->names) {
        if (!is_set_[name]) limits_[name] = {};
        limits_[name].fail = setting->value;
        is_set_[name] = true;
    }
    return {};
}

Finding Tolerances::judge(std::size_t i, double value) const {
    Finding finding{subjects_[i].name, subjects_[i].section, subjects_[i].unit, value,
                    limits_[i],        Severity::same};
    if (value > finding.limits.fail)
        finding.severity = Severity::failure;
    else if (value > finding.limits.warn)
        finding.severity = Severity::warning;
    else if (value > 0)
        finding.severity = Severity::tolerated;
    return finding;
}

std::vector<Finding> judge(const Report& report, const Tolerances& tolerances) {
    std::vector<Finding> findings;
    const std::vector<std::string> names = finding_names();
    for (std::size_t i = 0; i < names.size(); ++i)
        findings.push_back(tolerances.judge(i, value_of(report, names[i])));
    return findings;
}

}  // namespace keratin::diff
