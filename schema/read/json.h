// JSON as the user wrote it: every value with its line and column, so that a message about a recipe
// or a scene can point at the place. Strict JSON (RFC 8259) plus // and /* */ comments.
#pragma once

#include "schema/result.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace keratin {

enum class JsonKind { null, boolean, number, string, array, object };

// "null", "true or false", "a number", "a string", "a list", "an object"
std::string_view json_kind_words(JsonKind kind);

struct JsonValue {
    JsonKind kind = JsonKind::null;
    std::uint32_t line = 0, column = 0;  // from 1; column counts bytes
    bool boolean = false;
    double number = 0;              // infinite when the text is beyond double
    std::string text;               // a string decoded to UTF-8; a number as written
    std::vector<JsonValue> items;   // entries of a list, values of an object
    std::vector<std::string> keys;  // of an object, one an item, no two alike
    std::vector<std::uint32_t> key_columns, key_lines;

    // The value of a key, or null when the object has no such key.
    const JsonValue* find(std::string_view key) const;
};

// "name:line:column"
std::string json_place(std::string_view name, std::uint32_t line, std::uint32_t column);

// Errors (input): what is not JSON, at `name`:line:column. Nesting deeper than 32 is refused.
Result<JsonValue> parse_json(std::string_view text, const std::string& name);

// The text with blanks in place of comments, for parsers that take none. `text` has passed
// parse_json.
std::string blank_comments(std::string_view text);

// The value at a path such as "strands[3].radius", or the nearest enclosing value that exists.
const JsonValue& json_at(const JsonValue& root, std::string_view path);

// The whole of a text file. Errors: io, with the system's reason.
Result<std::string> read_text_file(const std::string& path);

// `path` seen from `folder`; unchanged when absolute or when folder is empty.
std::string resolve_path(const std::string& folder, const std::string& path);

// The folder of a file, for resolve_path.
std::string folder_of(const std::string& path);

}  // namespace keratin
