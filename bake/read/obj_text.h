// The text of an OBJ file, cut into statements and words.
#pragma once

#include "schema/result.h"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace keratin {

// A statement: its words and the line on which it starts, from 1. The words point into the text.
struct ObjStatement {
    std::vector<std::string_view> words;  // not empty
    int line = 0;
};

// Walks over the statements: comments (#) are left out, a `\` at the end of a line joins it with
// the next.
class ObjStatements {
  public:
    explicit ObjStatements(std::string_view text) : text_(text) {}
    // False at the end of the text.
    bool next(ObjStatement& statement);

  private:
    std::string_view text_;
    std::size_t at_ = 0;
    int line_ = 1;
};

// Numbers as a whole word, whatever the locale; nan and inf are numbers here, "1,5" is none.
std::optional<double> parse_number(std::string_view word);
std::optional<long long> parse_integer(std::string_view word);

// "file:line:column" of a word that points into the text.
std::string place_of(std::string_view word, std::string_view text, const std::string& file);

// Place in a list of `count` items of an OBJ index: from 1, or negative from the list's end.
std::optional<std::size_t> resolve_index(long long index, std::size_t count);

// The numbers after a statement's name; the error names the place of what is wrong. At least
// `needed` must be there; those of `out` that are not become 0, further words are not looked at.
Result<void> read_numbers(const ObjStatement& statement, std::string_view text,
                          const std::string& file, std::size_t needed, std::span<double> out);

// What the words after a name spell, joined by single blanks.
std::string join_words(const ObjStatement& statement, std::size_t first);

}  // namespace keratin
