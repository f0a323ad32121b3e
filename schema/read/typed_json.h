// JSON typed by a FlatBuffers schema. FlatBuffers' parser makes the values; the check before it
// refuses what that parser lets through: unknown fields without a suggestion, numbers in strings,
// several words for one choice, numbers that are not finite or out of the schema's `range`.
#pragma once

#include "schema/read/json.h"
#include "schema/result.h"

#include <flatbuffers/idl.h>

#include <string>

namespace keratin {

// A document that follows its schema: `parser.builder_` holds it as a FlatBuffer.
struct TypedJson {
    std::string name;  // of the file, for messages
    JsonValue root;
    flatbuffers::Parser parser;

    template <class Table>
    const Table& table() const {
        return *flatbuffers::GetRoot<Table>(parser.builder_.GetBufferPointer());
    }
    // An input error at the value that `path` names: "scene.json:12:5: strands[3].radius".
    Error wrong(const std::string& path, std::string message) const;
};

// Reads `text` by the schema into `out`. Errors (input): with line, column and path.
Result<void> read_typed_json(const std::string& text, const std::string& name,
                             const char* schema_text, TypedJson& out);

// Checks one value against a table of the parser's schema, as read_typed_json does with the root.
Result<void> check_table(const flatbuffers::Parser& parser, const std::string& table,
                         const JsonValue& value, const std::string& name, const std::string& path);

// The word of `known` nearest to `word` if it is near enough to be what was meant, or "".
std::string nearest_word(const std::string& word, const std::vector<std::string>& known);

}  // namespace keratin
