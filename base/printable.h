// Text from a file or a device, made safe to print on a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace palpate {

/// Longest text that `printable` leaves whole [characters].
inline constexpr std::size_t longest_printable = 1000;

/// `text` on one line and safe on a terminal: control characters (escape sequences begin with one),
/// bidirectional marks and invisible characters are written as \n, \x1b or \u202e, bytes that are not UTF-8
/// as \xff. A text of more than `longest` characters loses its middle (…).
std::string printable(std::string_view text, std::size_t longest = longest_printable);

/// `text` as one word of a command to be typed: as `printable` gives it, in single quotes if a POSIX shell
/// would split or expand it.
std::string shell_word(std::string_view text);

/// A text of several lines, each made `printable` and shortened by itself; those after the first begin with
/// `indent`.
std::string printable_lines(std::string_view text, std::string_view indent = "");

}  // namespace palpate
