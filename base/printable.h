// Text that came from a file or a device, made fit for a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace palpate {

/// Longest text that `printable` leaves whole [characters].
inline constexpr std::size_t longest_printable = 1000;

/// `text` in one line that does nothing to a terminal: control characters (escape sequences begin with one),
/// marks that change the direction of writing and invisible ones are written as \n, \x1b or \u202e, bytes
/// that are not UTF-8 as \xff. Of a text with more than `longest` characters the middle is left out (…).
std::string printable(std::string_view text, std::size_t longest = longest_printable);

/// `text` as one word of a command that is to be typed: as `printable` gives it, in single quotes where a
/// POSIX shell would take it apart or read something into it.
std::string shell_word(std::string_view text);

/// A text of several lines, each cleaned and shortened as `printable` does it: each line is cut for itself,
/// and those after the first begin with `indent`.
std::string printable_lines(std::string_view text, std::string_view indent = "");

}  // namespace palpate
