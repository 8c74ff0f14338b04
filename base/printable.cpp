#include "base/printable.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace palpate {
namespace {

/// A character of a text: its code point, or the value of a byte that is not valid UTF-8.
struct Character {
  std::uint32_t number = 0;
  std::size_t bytes = 1;
  bool is_valid = true;
};

/// The first character of `text`, which is not empty.
Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const Character invalid = {lead, 1, false};
  const std::size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes) return invalid;
  std::uint32_t number = lead & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return invalid;
    number = number << 6U | (byte(i) & 0x3fU);
  }
  constexpr std::array<std::uint32_t, 5> least = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = number >= 0xd800 && number <= 0xdfff;
  if (number < least[bytes] || number > 0x10ffff || is_surrogate) return invalid;
  return {number, bytes, true};
}

struct Range {
  std::uint32_t first, last;
};

/// Control characters, bidirectional marks, line separators, invisible characters and tags.
constexpr std::array<Range, 14> not_shown = {{{0x00, 0x1f},
                                              {0x7f, 0x9f},
                                              {0xad, 0xad},
                                              {0x61c, 0x61c},
                                              {0x180e, 0x180e},
                                              {0x200b, 0x200f},
                                              {0x2028, 0x202e},
                                              {0x2060, 0x206f},
                                              {0xfeff, 0xfeff},
                                              {0xfff0, 0xfffb},
                                              {0xfffe, 0xffff},
                                              {0xe000, 0xf8ff},
                                              {0xe0000, 0xe007f},
                                              {0xf0000, 0x10ffff}}};

std::string shown(const Character& character, std::string_view bytes) {
  const std::uint32_t number = character.number;
  const bool hidden = std::any_of(not_shown.begin(), not_shown.end(), [number](const Range& range) {
    return number >= range.first && number <= range.last;
  });
  if (character.is_valid && !hidden) return std::string(bytes);
  if (number == '\n') return "\\n";
  if (number == '\r') return "\\r";
  if (number == '\t') return "\\t";
  const char* const format = number < 0x100 ? "\\x%02x" : number < 0x10000 ? "\\u%04x" : "\\U%08x";
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), format, number);
  return text.data();
}

}  // namespace

std::string printable(std::string_view text, std::size_t longest) {
  std::string clean;
  std::vector<std::size_t> begins;  // of each character in `clean`
  while (!text.empty()) {
    const Character character = first_of(text);
    begins.push_back(clean.size());
    clean += shown(character, text.substr(0, character.bytes));
    text.remove_prefix(character.bytes);
  }
  if (begins.size() <= longest || longest < 2) return clean;
  const std::size_t tail = longest / 3;
  const std::size_t head = longest - 1 - tail;
  return clean.substr(0, begins[head]) + "…" + clean.substr(begins[begins.size() - tail]);
}

std::string shell_word(std::string_view path) {
  const std::string text = (path.starts_with('-') ? "./" : "") + std::string(path);  // else it is an option
  const auto is_plain = [](unsigned char c) {
    return c >= 0x80 || std::isalnum(c) != 0 ||
           std::string_view("%+,-./:=@_").find(static_cast<char>(c)) != std::string_view::npos;
  };
  if (!text.empty() && std::all_of(text.begin(), text.end(), is_plain)) return printable(text);
  std::string word = "'";
  for (const char c : text) {
    if (c == '\'') {
      word += "'\\''";
    } else {
      word += c;
    }
  }
  return printable(word + "'");
}

std::string printable_lines(std::string_view text, std::string_view indent) {
  std::string clean;
  for (;;) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    clean += printable(text.substr(0, end));
    if (end == text.size()) return clean;
    clean += '\n';
    text.remove_prefix(end + 1);
    if (!text.empty()) clean += indent;
  }
}

}  // namespace palpate
