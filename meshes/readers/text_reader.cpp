#include "meshes/readers/text_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "base/error.h"
#include "base/regular_file.h"

namespace palpate {
namespace {

constexpr std::string_view space = " \t\r\n\f\v";
constexpr const char* remake = "The file may be damaged or cut short: write it again";

/// The word without the leading plus that some programs write and from_chars rejects.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

template <class Number>
bool parse(std::string_view word, Number& value) {
  word = without_plus(word);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

/// Start of a word, at most 40 bytes, for a message; bytes that are no text are shown as '?'.
std::string shown(std::string_view word) {
  std::string result(word.substr(0, 40));
  std::replace_if(
      result.begin(), result.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return word.size() > 40 ? result + "..." : result;
}

/// Text with \n as line ending and without UTF-8's byte order mark.
std::string plain(std::string text) {
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  std::size_t size = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') continue;
    text[size++] = text[i] == '\r' ? '\n' : text[i];
  }
  text.resize(size);
  return text;
}

}  // namespace

TextReader::TextReader(const std::filesystem::path& file, char comment)
    : TextReader(file, read_all(file), comment) {}

TextReader::TextReader(std::filesystem::path file, std::string text, char comment)
    : file_(std::move(file)), text_(plain(std::move(text))), comment_(comment) {
  if (text_.starts_with("\xff\xfe") || text_.starts_with("\xfe\xff"))
    fail("the file is text in UTF-16", "Save it as UTF-8 or ASCII");
  if (at_end()) fail("the file is empty");
}

bool TextReader::continues(std::size_t i) const {
  return text_[i] == '\\' && i + 1 < text_.size() && text_[i + 1] == '\n';
}

void TextReader::skip_space() {
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (comment_ != '\0' && c == comment_) {
      position_ = std::min(text_.find('\n', position_), text_.size());
    } else if (space.find(c) != std::string_view::npos || continues(position_)) {
      if (c == '\n') ++line_;
      ++position_;
    } else {
      return;
    }
  }
}

bool TextReader::at_end() {
  skip_space();
  return position_ == text_.size();
}

std::string_view TextReader::peek() {
  skip_space();
  std::size_t end = position_;
  while (end < text_.size() && space.find(text_[end]) == std::string_view::npos &&
         (comment_ == '\0' || text_[end] != comment_) && !continues(end)) {
    ++end;
  }
  return std::string_view(text_).substr(position_, end - position_);
}

std::string_view TextReader::word(const char* what) {
  const std::string_view next = peek();
  word_line_ = line_;
  if (next.empty()) fail(fmt::format("the file ends where {} should be", what));
  position_ += next.size();
  return next;
}

void TextReader::expect(std::string_view expected) {
  const std::string_view found = word(std::string(expected).c_str());
  if (found != expected) fail_on(found, std::string(expected).c_str());
}

std::int64_t TextReader::integer(const char* what) {
  const std::string_view found = word(what);
  std::int64_t value = 0;
  if (!parse(found, value)) fail_on(found, what);
  return value;
}

std::int64_t TextReader::integer(const char* what, std::int64_t low, std::int64_t high) {
  const std::int64_t value = integer(what);
  if (value < low || value > high) {
    fail(high < low ? fmt::format("{} is {}, but there are none", what, value)
                    : fmt::format("{} is {}, which is not in {} to {}", what, value, low, high));
  }
  return value;
}

std::int64_t TextReader::count(const char* what, std::int64_t words) {
  const std::int64_t value = integer(what, 0, std::numeric_limits<Index>::max());
  const auto left = static_cast<std::int64_t>(text_.size() - position_);
  // A word takes at least two bytes with the space before it.
  if (value * words > left / 2) {
    fail(fmt::format("{} is {}, but only {} bytes are left of the file", what, value, left));
  }
  return value;
}

Index TextReader::tag() {
  constexpr Index limit = std::numeric_limits<Index>::max();
  return static_cast<Index>(integer("a tag", -limit, limit));
}

double TextReader::number(const char* what) {
  const std::string_view found = word(what);
  double value = 0.0;
  if (!parse(found, value)) fail_on(found, what);
  if (!std::isfinite(value)) fail(fmt::format("{} is not a finite number: '{}'", what, shown(found)));
  return value;
}

Vec3 TextReader::point() {
  const double x = number("a coordinate"), y = number("a coordinate"), z = number("a coordinate");
  return {x, y, z};
}

Vec3 TextReader::plane_point() {
  const double x = number("a coordinate"), y = number("a coordinate");
  return {x, y, 0.0};
}

void TextReader::skip_words(std::int64_t count, const char* what) {
  for (std::int64_t i = 0; i < count; ++i) word(what);
}

void TextReader::skip_letters(std::size_t count) {
  skip_space();
  position_ += count;
}

bool TextReader::on_line() {
  for (; position_ < text_.size(); ++position_) {
    const char c = text_[position_];
    if (continues(position_)) {
      ++position_;
      ++line_;
    } else if (c == '\n' || (comment_ != '\0' && c == comment_)) {
      return false;
    } else if (space.find(c) == std::string_view::npos) {
      return true;
    }
  }
  return false;
}

std::int64_t TextReader::words_on_line() const {
  std::int64_t words = 0;
  bool in_word = false;
  for (std::size_t i = position_; i < text_.size() && text_[i] != '\n' && text_[i] != comment_; ++i) {
    const bool is_space = space.find(text_[i]) != std::string_view::npos;
    if (!is_space && !in_word) ++words;
    in_word = !is_space;
  }
  return words;
}

std::string_view TextReader::rest_of_line() {
  word_line_ = line_;
  const std::size_t end = std::min(text_.find('\n', position_), text_.size());
  std::string_view rest = std::string_view(text_).substr(position_, end - position_);
  position_ = end;
  if (position_ < text_.size()) {
    ++position_;
    ++line_;
  }
  if (comment_ != '\0') rest = rest.substr(0, rest.find(comment_));
  while (!rest.empty() && space.find(rest.back()) != std::string_view::npos) rest.remove_suffix(1);
  return rest;
}

void TextReader::fail(const std::string& what, const std::string& hint) const {
  throw Error(what, fmt::format("{}:{}", file_.string(), word_line_), hint);
}

void TextReader::fail(const std::string& what) const {
  fail(what, remake);
}

void TextReader::fail_on(std::string_view found, const char* what) const {
  const bool has_comma =  // one: a list of numbers has more
      found.find_first_not_of("+-0123456789,") == found.npos && std::ranges::count(found, ',') == 1;
  fail(fmt::format("'{}' stands where {} should be", shown(found), what),
       has_comma ? "write decimals with a point" : remake);
}

}  // namespace palpate
