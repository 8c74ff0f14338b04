// Words and numbers of a text file, independent of the locale, with the line for error messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "meshes/mesh.h"

namespace palpate {

/// Reader of a text file word by word, for any line ending, with or without a byte order mark. Every reading
/// function throws Error (where = "file:line") if the next text is not what was asked for; `what` names that
/// in the message, e.g. "a node number".
class TextReader {
 public:
  /// Text from `comment` to the end of its line is skipped ('\0': there are no comments).
  /// Throws Error when the file cannot be read or holds nothing.
  explicit TextReader(const std::filesystem::path& file, char comment = '\0');
  /// Reads `text`, which is in `file`.
  TextReader(std::filesystem::path file, std::string text, char comment);

  /// True if no word is left.
  [[nodiscard]] bool at_end();
  /// The next word, without reading past it; empty at the end.
  [[nodiscard]] std::string_view peek();
  std::string_view word(const char* what);
  void expect(std::string_view word);
  std::int64_t integer(const char* what);
  /// A whole number in [low, high].
  std::int64_t integer(const char* what, std::int64_t low, std::int64_t high);
  /// A number of items, each of which takes at least `words` of the words left in the file.
  std::int64_t count(const char* what, std::int64_t words);
  /// A region or boundary tag.
  Index tag();
  /// A finite number.
  double number(const char* what);
  Vec3 point();
  Vec3 plane_point();  ///< two coordinates, z = 0
  void skip_words(std::int64_t count, const char* what);
  /// Skips letters of the next word, which then begins behind them.
  void skip_letters(std::size_t count);

  /// True if a word is left on the line; a backslash at its end continues a line.
  [[nodiscard]] bool on_line();

  /// Number of words left on the line, without reading past them.
  [[nodiscard]] std::int64_t words_on_line() const;
  /// Rest of the line, without its end.
  std::string_view rest_of_line();

  /// Throws Error about the word read last.
  [[noreturn]] void fail(const std::string& what, const std::string& hint) const;
  [[noreturn]] void fail(const std::string& what) const;
  /// Throws Error: `found` is not the expected `what`.
  [[noreturn]] void fail_on(std::string_view found, const char* what) const;

 private:
  void skip_space();
  /// True if a backslash at the end of a line is at position i.
  [[nodiscard]] bool continues(std::size_t i) const;

  std::filesystem::path file_;
  std::string text_;
  char comment_;
  std::size_t position_ = 0;
  std::int64_t line_ = 1;       // of position_
  std::int64_t word_line_ = 1;  // of the word read last
};

}  // namespace palpate
