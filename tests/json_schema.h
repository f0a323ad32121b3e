// Checks a JSON document against a JSON Schema: the part of the language that schema/report uses.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace keratin::test {

// Empty when `value` follows `schema`, else where and why not. Fails on a keyword it does not know.
std::string schema_misfit(const nlohmann::json& schema, const nlohmann::json& value);

}  // namespace keratin::test
