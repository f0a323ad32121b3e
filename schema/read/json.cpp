#include "schema/read/json.h"

#include "schema/files/write_file.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <set>

namespace keratin {

namespace {

constexpr int kMaxDepth = 32;

// Raised inside the parser only; parse_json turns it into an Error.
struct Failure {
    std::size_t at;
    std::string message;
};

class JsonParser {
  public:
    explicit JsonParser(std::string_view text) : text_(text) {
        if (text_.substr(0, 3) == "\xef\xbb\xbf") at_ = line_start_ = 3;
    }

    JsonValue document() {
        JsonValue root = value(0);
        skip_space();
        if (at_ < text_.size()) fail("expected the end of the file after the outermost value");
        return root;
    }

    // Line and column of a byte, both from 1.
    std::pair<std::uint32_t, std::uint32_t> place(std::size_t at) const {
        at = std::min(at, text_.size());
        const auto before = text_.substr(0, at);
        const auto line =
            static_cast<std::uint32_t>(std::count(before.begin(), before.end(), '\n'));
        std::size_t start = before.rfind('\n');
        start = start == std::string_view::npos ? 0 : start + 1;
        if (line == 0 && text_.substr(0, 3) == "\xef\xbb\xbf" && at >= 3) start = 3;
        return {line + 1, static_cast<std::uint32_t>(at - start + 1)};
    }

  private:
    [[noreturn]] void fail(std::string message) const { throw Failure{at_, std::move(message)}; }
    [[noreturn]] void fail_at(std::size_t at, std::string message) const {
        throw Failure{at, std::move(message)};
    }

    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
    bool ended() const { return at_ >= text_.size(); }

    std::string found() const {
        if (ended()) return "the end of the file";
        const auto c = static_cast<unsigned char>(text_[at_]);
        if (c < 0x20) return "a control character";
        if (c >= 0x7f) return "a character outside a string";
        if (std::isalpha(c)) {
            std::size_t end = at_;
            while (end < text_.size() && end - at_ < 24 &&
                   (std::isalnum(static_cast<unsigned char>(text_[end])) || text_[end] == '_'))
                ++end;
            return "`" + std::string(text_.substr(at_, end - at_)) + "`";
        }
        return std::string("`") + text_[at_] + "`";
    }

    void newline() {
        ++line_;
        line_start_ = at_;
    }

    void skip_space() {
        while (!ended()) {
            const char c = text_[at_];
            if (c == '\n') {
                ++at_;
                newline();
            } else if (c == ' ' || c == '\t' || c == '\r') {
                ++at_;
            } else if (text_.substr(at_, 2) == "//") {
                while (!ended() && text_[at_] != '\n') ++at_;
            } else if (text_.substr(at_, 2) == "/*") {
                const std::size_t begin = at_;
                at_ += 2;
                while (!ended() && text_.substr(at_, 2) != "*/") {
                    if (text_[at_++] == '\n') newline();
                }
                if (ended()) fail_at(begin, "this comment has no end; write */");
                at_ += 2;
            } else {
                return;
            }
        }
    }

    JsonValue value(int depth) {
        if (depth > kMaxDepth) fail("nested too deep");
        skip_space();
        JsonValue out;
        out.line = line_;
        out.column = static_cast<std::uint32_t>(at_ - line_start_ + 1);
        const char c = peek();
        if (c == '{') {
            object(out, depth);
        } else if (c == '[') {
            array(out, depth);
        } else if (c == '"') {
            out.kind = JsonKind::string;
            out.text = string();
        } else if (c == '-' || (c >= '0' && c <= '9')) {
            number(out);
        } else if (word("true")) {
            out.kind = JsonKind::boolean;
            out.boolean = true;
        } else if (word("false")) {
            out.kind = JsonKind::boolean;
        } else if (word("null")) {
            out.kind = JsonKind::null;
        } else {
            const bool letters = std::isalpha(static_cast<unsigned char>(c)) != 0;
            fail("expected a value but found " + found() +
                 (letters ? "; a number is written in digits, a word between \" and \"" : ""));
        }
        return out;
    }

    bool word(std::string_view w) {
        if (text_.substr(at_, w.size()) != w) return false;
        const std::size_t after = at_ + w.size();
        if (after < text_.size() && std::isalnum(static_cast<unsigned char>(text_[after])))
            return false;
        at_ = after;
        return true;
    }

    void object(JsonValue& out, int depth) {
        out.kind = JsonKind::object;
        ++at_;
        skip_space();
        if (peek() == '}') {
            ++at_;
            return;
        }
        std::set<std::string_view> seen;
        for (;;) {
            skip_space();
            if (peek() == '}') fail("a comma before } is one too many");
            if (peek() != '"')
                fail("expected the name of a field between \" and \" but found " + found());
            const std::size_t begin = at_;
            out.key_lines.push_back(line_);
            out.key_columns.push_back(static_cast<std::uint32_t>(at_ - line_start_ + 1));
            std::string key = string();
            if (!seen.insert(text_.substr(begin, at_ - begin)).second)
                fail_at(begin, "the field `" + key + "` is written twice");
            skip_space();
            if (peek() != ':') fail("expected : after the name of a field but found " + found());
            ++at_;
            JsonValue member = value(depth + 1);
            out.keys.push_back(std::move(key));
            out.items.push_back(std::move(member));
            skip_space();
            if (peek() == ',') {
                ++at_;
            } else if (peek() == '}') {
                ++at_;
                return;
            } else {
                fail("expected , or } but found " + found());
            }
        }
    }

    void array(JsonValue& out, int depth) {
        out.kind = JsonKind::array;
        ++at_;
        skip_space();
        if (peek() == ']') {
            ++at_;
            return;
        }
        for (;;) {
            skip_space();
            if (peek() == ']') fail("a comma before ] is one too many");
            out.items.push_back(value(depth + 1));
            skip_space();
            if (peek() == ',') {
                ++at_;
            } else if (peek() == ']') {
                ++at_;
                return;
            } else {
                fail("expected , or ] but found " + found());
            }
        }
    }

    void digits() {
        if (!(peek() >= '0' && peek() <= '9')) fail("this number lacks a digit here");
        while (peek() >= '0' && peek() <= '9') ++at_;
    }

    void number(JsonValue& out) {
        out.kind = JsonKind::number;
        const std::size_t begin = at_;
        if (peek() == '-') ++at_;
        if (peek() == '0') {
            ++at_;
            if (peek() >= '0' && peek() <= '9') fail_at(begin, "a number does not start with 0");
            if (peek() == 'x' || peek() == 'X') fail_at(begin, "numbers are written in decimal");
        } else {
            digits();
        }
        if (peek() == '.') {
            ++at_;
            digits();
        }
        if (peek() == 'e' || peek() == 'E') {
            ++at_;
            if (peek() == '+' || peek() == '-') ++at_;
            digits();
        }
        out.text = std::string(text_.substr(begin, at_ - begin));
        const auto [end, code] =
            std::from_chars(out.text.data(), out.text.data() + out.text.size(), out.number);
        (void)end;
        // from_chars says the same of a number that is too large and of one too near to zero.
        if (code == std::errc::result_out_of_range)
            out.number = std::strtod(out.text.c_str(), nullptr);
    }

    std::uint32_t hex4() {
        std::uint32_t code = 0;
        for (int i = 0; i < 4; ++i, ++at_) {
            const char c = peek();
            code = code * 16;
            if (c >= '0' && c <= '9')
                code += static_cast<std::uint32_t>(c - '0');
            else if (c >= 'a' && c <= 'f')
                code += static_cast<std::uint32_t>(c - 'a' + 10);
            else if (c >= 'A' && c <= 'F')
                code += static_cast<std::uint32_t>(c - 'A' + 10);
            else
                fail("\\u takes four hexadecimal digits");
        }
        return code;
    }

    static void append_utf8(std::string& out, std::uint32_t code) {
        const auto put = [&](std::uint32_t byte) { out.push_back(static_cast<char>(byte)); };
        if (code < 0x80) {
            put(code);
        } else if (code < 0x800) {
            put(0xc0 | (code >> 6));
            put(0x80 | (code & 0x3f));
        } else if (code < 0x10000) {
            put(0xe0 | (code >> 12));
            put(0x80 | ((code >> 6) & 0x3f));
            put(0x80 | (code & 0x3f));
        } else {
            put(0xf0 | (code >> 18));
            put(0x80 | ((code >> 12) & 0x3f));
            put(0x80 | ((code >> 6) & 0x3f));
            put(0x80 | (code & 0x3f));
        }
    }

    std::string string() {
        const std::size_t begin = at_++;
        std::string out;
        for (;;) {
            if (ended() || peek() == '\n') fail_at(begin, "this string has no closing \"");
            const char c = text_[at_];
            if (c == '"') {
                ++at_;
                return out;
            }
            if (static_cast<unsigned char>(c) < 0x20) fail("a control character inside a string");
            ++at_;
            if (c != '\\') {
                out.push_back(c);
                continue;
            }
            const char escape = peek();
            ++at_;
            switch (escape) {
                case '"':
                    out.push_back('"');
                    break;
                case '\\':
                    out.push_back('\\');
                    break;
                case '/':
                    out.push_back('/');
                    break;
                case 'b':
                    out.push_back('\b');
                    break;
                case 'f':
                    out.push_back('\f');
                    break;
                case 'n':
                    out.push_back('\n');
                    break;
                case 'r':
                    out.push_back('\r');
                    break;
                case 't':
                    out.push_back('\t');
                    break;
                case 'u': {
                    const std::size_t here = at_ - 2;
                    std::uint32_t code = hex4();
                    if (code >= 0xd800 && code < 0xdc00 && text_.substr(at_, 2) == "\\u") {
                        at_ += 2;
                        const std::uint32_t low = hex4();
                        if (low < 0xdc00 || low > 0xdfff) fail_at(here, "half of a surrogate pair");
                        code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
                    } else if (code >= 0xd800 && code <= 0xdfff) {
                        fail_at(here, "half of a surrogate pair");
                    }
                    if (code == 0) fail_at(here, "a string cannot hold the character 0");
                    append_utf8(out, code);
                    break;
                }
                default:
                    --at_;
                    fail("unknown escape after \\; a backslash itself is written \\\\");
            }
        }
    }

    std::string_view text_;
    std::size_t at_ = 0, line_start_ = 0;
    std::uint32_t line_ = 1;
};

}  // namespace

std::string_view json_kind_words(JsonKind kind) {
    switch (kind) {
        case JsonKind::null:
            return "null";
        case JsonKind::boolean:
            return "true or false";
        case JsonKind::number:
            return "a number";
        case JsonKind::string:
            return "a string";
        case JsonKind::array:
            return "a list";
        case JsonKind::object:
            return "an object";
    }
    return "";
}

const JsonValue* JsonValue::find(std::string_view key) const {
    for (std::size_t i = 0; i < keys.size(); ++i)
        if (keys[i] == key && i < items.size()) return &items[i];
    return nullptr;
}

std::string json_place(std::string_view name, std::uint32_t line, std::uint32_t column) {
    return std::string(name) + ":" + std::to_string(line) + ":" + std::to_string(column);
}

Result<JsonValue> parse_json(std::string_view text, const std::string& name) {
    JsonParser parser(text);
    try {
        return parser.document();
    } catch (const Failure& failure) {
        const auto [line, column] = parser.place(failure.at);
        return Error{ErrorCode::input, json_place(name, line, column), failure.message};
    }
}

std::string blank_comments(std::string_view text) {
    std::string out(text);
    std::size_t at = 0;
    const auto blank = [&](std::size_t end) {
        for (; at < end; ++at)
            if (out[at] != '\n') out[at] = ' ';
    };
    while (at < out.size()) {
        if (out[at] == '"') {
            for (++at; at < out.size() && out[at] != '"'; ++at)
                if (out[at] == '\\') ++at;
            ++at;
        } else if (text.substr(at, 2) == "//") {
            blank(std::min(text.find('\n', at), text.size()));
        } else if (text.substr(at, 2) == "/*") {
            blank(std::min(text.find("*/", at + 2), text.size() - 2) + 2);
        } else {
            ++at;
        }
    }
    return out;
}

const JsonValue& json_at(const JsonValue& root, std::string_view path) {
    const JsonValue* here = &root;
    while (!path.empty()) {
        const JsonValue* next = nullptr;
        if (path.front() == '[') {
            std::size_t index = 0;
            const std::size_t close = path.find(']');
            std::from_chars(path.data() + 1, path.data() + close, index);
            path.remove_prefix(close + 1);
            if (index < here->items.size()) next = &here->items[index];
        } else {
            if (path.front() == '.') path.remove_prefix(1);
            const std::size_t end = std::min(path.find_first_of(".["), path.size());
            next = here->find(path.substr(0, end));
            path.remove_prefix(end);
        }
        if (!next) return *here;
        here = next;
    }
    return *here;
}

Result<std::string> read_text_file(const std::string& path) {
    auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

std::string resolve_path(const std::string& folder, const std::string& path) {
    if (path.empty() || folder.empty()) return path;
    return (std::filesystem::path(folder) / path).lexically_normal().string();
}

std::string folder_of(const std::string& path) {
    return std::filesystem::path(path).parent_path().string();
}

}  // namespace keratin
