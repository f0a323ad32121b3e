#include "schema/read/typed_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>

namespace keratin {

namespace {

using flatbuffers::BaseType;
using flatbuffers::FieldDef;
using flatbuffers::StructDef;

// An interval as a schema writes it: "(0, 1]".
struct Interval {
    double low, high;
    bool open_low, open_high;

    bool holds(double x) const {
        return (open_low ? x > low : x >= low) && (open_high ? x < high : x <= high);
    }
};

Interval parse_interval(const std::string& text) {
    Interval out{};
    char* after = nullptr;
    out.open_low = text.front() == '(';
    out.low = std::strtod(text.c_str() + 1, &after);
    out.high = std::strtod(after + 1, &after);
    out.open_high = *after == ')';
    return out;
}

std::string number_text(double x) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, x).ptr;
    return {buffer, end};
}

std::string interval_words(const Interval& i) {
    return (i.open_low ? "above " : "at least ") + number_text(i.low) +
           (i.open_high ? " and below " : " and at most ") + number_text(i.high);
}

std::string attribute(const FieldDef& field, const char* key) {
    const auto* value = field.attributes.Lookup(key);
    return value ? value->constant : std::string();
}

std::string list_of(const std::vector<std::string>& words) {
    std::string out;
    for (std::size_t i = 0; i < words.size(); ++i)
        out += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return out;
}

// A word in backquotes, cut short when someone wrote a novel.
std::string quoted(const std::string& text) {
    return "`" + (text.size() > 40 ? text.substr(0, 40) + "..." : text) + "`";
}

class Checker {
  public:
    Checker(const std::string& name) : name_(name) {}

    Result<void> table(const StructDef& def, const JsonValue& value, const std::string& path) {
        if (value.kind != JsonKind::object) return wrong_kind(value, path, "an object { ... }");
        std::vector<std::string> known;
        for (const FieldDef* field : def.fields.vec) known.push_back(field->name);
        for (std::size_t i = 0; i < value.items.size(); ++i) {
            const std::string& key = value.keys[i];
            const FieldDef* field = def.fields.Lookup(key);
            if (!field) {
                const std::string near = nearest_word(key, known);
                const std::string help = near.empty() ? "known here: " + list_of(known)
                                                      : "did you mean " + quoted(near) + "?";
                return Error{ErrorCode::input,
                             json_place(name_, value.key_lines[i], value.key_columns[i]) +
                                 (path.empty() ? "" : ": " + path),
                             "unknown field " + quoted(key) + "; " + help};
            }
            const std::string field_path = path.empty() ? key : path + "." + key;
            if (auto ok = member(*field, value.items[i], field_path); !ok) return ok;
        }
        for (const FieldDef* field : def.fields.vec)
            if (field->attributes.Lookup("must") && !value.find(field->name))
                return fail(value, path, "the field `" + field->name + "` is missing");
        return {};
    }

  private:
    Error fail(const JsonValue& value, const std::string& path, std::string message) const {
        return {ErrorCode::input,
                json_place(name_, value.line, value.column) + (path.empty() ? "" : ": " + path),
                std::move(message)};
    }

    Error wrong_kind(const JsonValue& value, const std::string& path,
                     const std::string& expected) const {
        if (value.kind == JsonKind::null)
            return fail(value, path,
                        "expected " + expected +
                            " but found null; leave the field out for its "
                            "default");
        std::string message = "expected " + expected + " but found ";
        if (value.kind == JsonKind::string)
            message += "the string \"" + value.text + "\"";
        else if (value.kind == JsonKind::number)
            message += "the number " + value.text;
        else if (value.kind == JsonKind::boolean)
            message += value.boolean ? "true" : "false";
        else
            message += json_kind_words(value.kind);
        if (value.kind == JsonKind::string && expected == "a number") {
            double number = 0;
            const auto& text = value.text;
            const auto end = std::from_chars(text.data(), text.data() + text.size(), number).ptr;
            if (!text.empty() && end == text.data() + text.size())
                message += "; write it without the quotation marks";
        }
        return fail(value, path, message);
    }

    Result<void> member(const FieldDef& field, const JsonValue& value, const std::string& path) {
        const auto& type = field.value.type;
        if (type.base_type != flatbuffers::BASE_TYPE_VECTOR)
            return single(field, type, value, path);
        if (value.kind != JsonKind::array) return wrong_kind(value, path, "a list [ ... ]");
        if (const std::string count = attribute(field, "count"); !count.empty()) {
            const Interval interval = parse_interval(count);
            if (!interval.holds(static_cast<double>(value.items.size())))
                return fail(value, path,
                            "has " + std::to_string(value.items.size()) +
                                (value.items.size() == 1 ? " entry" : " entries") +
                                "; it takes at least " + number_text(interval.low) +
                                " and at most " + number_text(interval.high));
        }
        for (std::size_t i = 0; i < value.items.size(); ++i)
            if (auto ok = single(field, type.VectorType(), value.items[i],
                                 path + "[" + std::to_string(i) + "]");
                !ok)
                return ok;
        return {};
    }

    Result<void> single(const FieldDef& field, const flatbuffers::Type& type,
                        const JsonValue& value, const std::string& path) {
        switch (type.base_type) {
            case flatbuffers::BASE_TYPE_STRING:
                if (value.kind != JsonKind::string) return wrong_kind(value, path, "a string");
                if (value.text.empty())
                    return fail(value, path, "is empty; leave the field out instead");
                return {};
            case flatbuffers::BASE_TYPE_STRUCT:
                return type.struct_def->fixed ? components(field, *type.struct_def, value, path)
                                              : table(*type.struct_def, value, path);
            case flatbuffers::BASE_TYPE_BOOL:
                if (value.kind != JsonKind::boolean)
                    return wrong_kind(value, path, "true or false");
                return {};
            default:
                return type.enum_def ? choice(*type.enum_def, value, path)
                                     : number(field, type.base_type, value, path);
        }
    }

    // A struct of doubles, written as a list.
    Result<void> components(const FieldDef& field, const StructDef& def, const JsonValue& value,
                            const std::string& path) {
        const std::size_t count = def.fields.vec.size();
        std::string shape = "[";
        for (std::size_t i = 0; i < count; ++i) shape += (i ? ", " : "") + def.fields.vec[i]->name;
        shape += "]";
        if (value.kind != JsonKind::array) return wrong_kind(value, path, "the list " + shape);
        if (value.items.size() != count)
            return fail(value, path,
                        "expected " + std::to_string(count) + " numbers " + shape + " but found " +
                            std::to_string(value.items.size()));
        for (std::size_t i = 0; i < count; ++i)
            if (auto ok = number(field, flatbuffers::BASE_TYPE_DOUBLE, value.items[i],
                                 path + "[" + std::to_string(i) + "]");
                !ok)
                return ok;
        return {};
    }

    Result<void> choice(const flatbuffers::EnumDef& def, const JsonValue& value,
                        const std::string& path) {
        std::vector<std::string> words;
        for (const auto* word : def.Vals()) words.push_back(word->name);
        if (value.kind != JsonKind::string)
            return wrong_kind(value, path, "one of the words " + list_of(words));
        if (std::find(words.begin(), words.end(), value.text) != words.end()) return {};
        const std::string near = nearest_word(value.text, words);
        return fail(value, path,
                    "expected " + list_of(words) + " but found " + quoted(value.text) +
                        (near.empty() ? "" : "; did you mean " + quoted(near) + "?"));
    }

    Result<void> number(const FieldDef& field, BaseType type, const JsonValue& value,
                        const std::string& path) {
        const bool whole = flatbuffers::IsInteger(type);
        if (value.kind != JsonKind::number)
            return wrong_kind(value, path, whole ? "a whole number" : "a number");
        if (!std::isfinite(value.number))
            return fail(value, path, value.text + " is too large for a number");
        const std::string range = attribute(field, "range");
        const Interval interval = parse_interval(range.empty() ? "[-1e300, 1e300]" : range);
        if (whole && value.text.find_first_of(".eE") != std::string::npos)
            return fail(value, path, "expected a whole number but found " + value.text);
        if (!interval.holds(value.number))
            return fail(value, path,
                        value.text + " is out of range; it must be " + interval_words(interval));
        if (!whole) return {};
        const char* begin = value.text.data();
        const char* end = begin + value.text.size();
        const bool fits = type == flatbuffers::BASE_TYPE_ULONG  ? parses<std::uint64_t>(begin, end)
                          : type == flatbuffers::BASE_TYPE_UINT ? parses<std::uint32_t>(begin, end)
                                                                : parses<std::int32_t>(begin, end);
        if (!fits)
            return fail(value, path,
                        value.text + " does not fit" +
                            (value.text.front() == '-' ? "; it must be at least 0" : ""));
        return {};
    }

    template <class Integer>
    static bool parses(const char* begin, const char* end) {
        Integer parsed{};
        const auto result = std::from_chars(begin, end, parsed);
        return result.ec == std::errc() && result.ptr == end;
    }

    const std::string& name_;
};

// Steps of inserting, removing or replacing a letter that lead from a to b.
std::size_t edit_distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t above = row[j + 1];
            row[j + 1] = std::min({above + 1, row[j] + 1, diagonal + (a[i] == b[j] ? 0u : 1u)});
            diagonal = above;
        }
    }
    return row.back();
}

}  // namespace

std::string nearest_word(const std::string& word, const std::vector<std::string>& known) {
    if (word.size() > 64) return "";
    std::string best;
    std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const std::string& candidate : known) {
        // Two short words are always near each other: half of the letters must agree.
        const std::size_t distance = edit_distance(word, candidate);
        if (distance < best_distance && 2 * distance <= candidate.size()) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

Error TypedJson::wrong(const std::string& path, std::string message) const {
    const JsonValue& value = json_at(root, path);
    return {ErrorCode::input, json_place(name, value.line, value.column) + ": " + path,
            std::move(message)};
}

Result<void> check_table(const flatbuffers::Parser& parser, const std::string& table,
                         const JsonValue& value, const std::string& name, const std::string& path) {
    const StructDef* def = parser.LookupStruct(table);
    if (!def) return Error{ErrorCode::internal, name, "the schema has no table " + table};
    return Checker(name).table(*def, value, path);
}

Result<void> read_typed_json(const std::string& text, const std::string& name,
                             const char* schema_text, TypedJson& out) {
    out.name = name;
    auto root = parse_json(text, name);
    if (!root) return root.error();
    out.root = std::move(*root);
    out.parser.opts.strict_json = true;
    if (!out.parser.Parse(schema_text))
        return Error{ErrorCode::internal, name, "the schema does not parse: " + out.parser.error_};
    if (auto ok = Checker(name).table(*out.parser.root_struct_def_, out.root, ""); !ok) return ok;
    if (!out.parser.ParseJson(blank_comments(text).c_str(), name.c_str()))
        return Error{ErrorCode::input, name, out.parser.error_};
    return {};
}

}  // namespace keratin
