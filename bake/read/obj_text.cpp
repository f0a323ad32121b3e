#include "bake/read/obj_text.h"

#include <algorithm>
#include <charconv>

namespace keratin {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

template <class T>
std::optional<T> parse(std::string_view word) {
    if (word.starts_with('+')) {
        word.remove_prefix(1);
        if (word.starts_with('-')) return {};
    }
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return {};
    return value;
}

}  // namespace

bool ObjStatements::next(ObjStatement& statement) {
    statement.words.clear();
    bool in_comment = false;
    while (at_ < text_.size()) {
        const char c = text_[at_];
        if (c == '\n') {
            ++at_;
            ++line_;
            in_comment = false;
            if (!statement.words.empty()) return true;
            continue;
        }
        if (in_comment || is_blank(c)) {
            ++at_;
            continue;
        }
        if (c == '#') {
            in_comment = true;
            continue;
        }
        if (c == '\\') {
            std::size_t after = at_ + 1;
            while (after < text_.size() && is_blank(text_[after])) ++after;
            if (after >= text_.size() || text_[after] == '\n') {
                at_ = std::min(after + 1, text_.size());
                ++line_;
                continue;
            }
        }
        const std::size_t begin = at_;
        while (at_ < text_.size() && !is_blank(text_[at_]) && text_[at_] != '\n' &&
               text_[at_] != '#' && (text_[at_] != '\\' || at_ == begin))
            ++at_;
        if (statement.words.empty()) statement.line = line_;
        statement.words.push_back(text_.substr(begin, at_ - begin));
    }
    return !statement.words.empty();
}

std::optional<double> parse_number(std::string_view word) {
    const auto value = parse<double>(word);
    if (value) return value;
    // from_chars reports what is too small for a double as out of range; such a number is 0.
    double unused = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), unused);
    const std::size_t exponent = word.find_first_of("eE");
    if (error == std::errc::result_out_of_range && end == word.data() + word.size() &&
        exponent != std::string_view::npos && exponent + 1 < word.size() &&
        word[exponent + 1] == '-')
        return 0;
    return {};
}

std::optional<long long> parse_integer(std::string_view word) { return parse<long long>(word); }

std::string place_of(std::string_view word, std::string_view text, const std::string& file) {
    const std::size_t offset = static_cast<std::size_t>(word.data() - text.data());
    const std::string_view before = text.substr(0, offset);
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0
    return file + ':' + std::to_string(line) + ':' + std::to_string(offset - line_start + 1);
}

std::optional<std::size_t> resolve_index(long long index, std::size_t count) {
    const auto size = static_cast<long long>(count);
    if (index > 0 && index <= size) return static_cast<std::size_t>(index - 1);
    if (index < 0 && -size <= index) return static_cast<std::size_t>(size + index);
    return {};
}

Result<void> read_numbers(const ObjStatement& statement, std::string_view text,
                          const std::string& file, std::size_t needed, std::span<double> out) {
    if (statement.words.size() < needed + 1)
        return Error{ErrorCode::input, place_of(statement.words[0], text, file),
                     '"' + std::string(statement.words[0]) + "\" needs " + std::to_string(needed) +
                         " numbers"};
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = 0;
        if (i + 1 >= statement.words.size()) continue;
        const std::string_view word = statement.words[i + 1];
        const auto value = parse_number(word);
        if (!value)
            return Error{ErrorCode::input, place_of(word, text, file),
                         '"' + std::string(word) + "\" is not a number"};
        out[i] = *value;
    }
    return {};
}

std::string join_words(const ObjStatement& statement, std::size_t first) {
    std::string joined;
    for (std::size_t i = first; i < statement.words.size(); ++i) {
        if (!joined.empty()) joined += ' ';
        joined += statement.words[i];
    }
    return joined;
}

}  // namespace keratin
