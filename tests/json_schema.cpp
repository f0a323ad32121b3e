#include "tests/json_schema.h"

#include <algorithm>
#include <set>

namespace keratin::test {

namespace {

using nlohmann::json;

bool has_type(const json& value, const std::string& type) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "integer") return value.is_number_integer();
    if (type == "number") return value.is_number();
    return type == "null" && value.is_null();
}

std::string check(const json& root, const json& schema, const json& value, const std::string& at);

std::string check_object(const json& root, const json& schema, const json& value,
                         const std::string& at) {
    for (const auto& name : schema.value("required", json::array()))
        if (!value.contains(name)) return at + " lacks " + std::string(name);
    const json dependent = schema.value("dependentRequired", json::object());
    for (const auto& [name, others] : dependent.items())
        for (const auto& other : others)
            if (value.contains(name) && !value.contains(other))
                return at + " lacks " + std::string(other);
    const json properties = schema.value("properties", json::object());
    for (const auto& [name, member] : value.items()) {
        const bool listed = properties.contains(name);
        if (!listed && !schema.contains("additionalProperties")) continue;
        const json& rule = listed ? properties[name] : schema["additionalProperties"];
        if (rule.is_boolean()) {
            if (!rule.get<bool>()) return at + "." + name + " is not listed";
            continue;
        }
        if (auto wrong = check(root, rule, member, at + "." + name); !wrong.empty()) return wrong;
    }
    return "";
}

std::string check(const json& root, const json& schema, const json& value, const std::string& at) {
    static const std::set<std::string> known{"$schema",
                                             "$defs",
                                             "$ref",
                                             "title",
                                             "description",
                                             "type",
                                             "enum",
                                             "const",
                                             "minimum",
                                             "required",
                                             "dependentRequired",
                                             "properties",
                                             "additionalProperties",
                                             "items",
                                             "anyOf"};
    for (const auto& [keyword, rule] : schema.items())
        if (!known.count(keyword)) return at + ": the schema uses " + keyword;
    if (schema.contains("$ref")) {
        const std::string pointer = schema["$ref"].get<std::string>().substr(1);
        return check(root, root.at(json::json_pointer(pointer)), value, at);
    }
    if (schema.contains("type")) {
        const json types =
            schema["type"].is_array() ? schema["type"] : json::array({schema["type"]});
        if (std::none_of(types.begin(), types.end(),
                         [&](const json& t) { return has_type(value, t); }))
            return at + " has the wrong type";
    }
    if (schema.contains("enum") &&
        std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end())
        return at + " has an unknown value";
    if (schema.contains("const") && schema["const"] != value) return at + " has another value";
    if (schema.contains("minimum") && value.is_number() &&
        value.get<double>() < schema["minimum"].get<double>())
        return at + " is too small";
    if (schema.contains("anyOf") &&
        std::none_of(schema["anyOf"].begin(), schema["anyOf"].end(),
                     [&](const json& rule) { return check(root, rule, value, at).empty(); }))
        return at + " fits none of the alternatives";
    if (value.is_object()) return check_object(root, schema, value, at);
    if (value.is_array() && schema.contains("items"))
        for (std::size_t i = 0; i < value.size(); ++i)
            if (auto wrong =
                    check(root, schema["items"], value[i], at + "[" + std::to_string(i) + "]");
                !wrong.empty())
                return wrong;
    return "";
}

}  // namespace

std::string schema_misfit(const json& schema, const json& value) {
    return check(schema, schema, value, "document");
}

}  // namespace keratin::test
