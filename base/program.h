// Start, end and output common to the programs.
#pragma once

#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "base/printable.h"

namespace palpate {

/// Runs `body`, the work of a program called `name`, and returns the exit status. Errors are printed on the
/// error stream and end with exit_input_error; `if_no_memory` is the hint when memory runs out. A failed
/// write ends no run: exceeding the limit of file sizes is an error, not a signal; text that cannot be
/// printed on the error stream is dropped, where fmt would throw in any thread; and if standard output is
/// lost (a full disk), that is reported and exit_ok becomes exit_input_error. Closed standard streams stay
/// reserved, so that no opened file takes their place.
[[nodiscard]] int run_program(const std::string& name, const std::string& if_no_memory,
                              const std::function<int()>& body);

/// Prints what is wrong with the command line, and a hint; returns exit_usage.
[[nodiscard]] int tell_usage(const std::string& what, const std::string& hint);

/// Makes SIGBUS, raised by reading a mapped file that was truncated or whose disk failed, end the program
/// with an error line that names the file, and exit_input_error, instead of a crash. A device's guardian then
/// takes its force to zero. For programs, not for libraries.
void end_with_an_error_on_shrunk_files();

/// A text or a path, which may come from a file, a device or the user, made `printable`; any other value
/// unchanged.
template <typename T>
decltype(auto) as_printed(const T& value) {
  if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return printable(value.string());
  } else if constexpr (std::is_convertible_v<const T&, std::string_view>) {
    return printable(value);
  } else {
    return (value);
  }
}

template <typename T>
using AsPrinted = std::remove_cvref_t<decltype(as_printed(std::declval<const T&>()))>;

/// fmt::print with each argument `as_printed`: a name cannot affect the terminal or begin a line.
template <typename... Args>
void say(std::FILE* stream, fmt::format_string<AsPrinted<Args>...> format, const Args&... args) {
  const auto print = [&](const auto&... printed) {
    fmt::vprint(stream, format, fmt::make_format_args(printed...));
  };
  print(as_printed(args)...);
}

/// Prints a text of several lines, each made `printable`; those after the first begin with `indent`.
inline void say_lines(std::FILE* stream, std::string_view text, std::string_view indent = "") {
  std::fputs(printable_lines(text, indent).c_str(), stream);
}

}  // namespace palpate
