// What the programs have in common: how they begin, end and print.
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

/// Runs `body`, the work of a program called `name`, and returns the exit status. Errors are told on the
/// error stream and end with exit_input_error; `if_no_memory` is what to do where there is no more memory. A
/// write that fails ends no run: one over the limit of file sizes is an error and no signal, what cannot be
/// printed on the error stream is lost in silence, where fmt would throw in any thread, and where some of
/// what was printed is lost (a full disk), that is told and the status is exit_input_error in place of
/// exit_ok. Standard streams that are closed stay without use, so that no file that is opened becomes one.
[[nodiscard]] int run_program(const std::string& name, const std::string& if_no_memory,
                              const std::function<int()>& body);

/// Tells what is wrong with the command line and what to do; returns exit_usage.
[[nodiscard]] int tell_usage(const std::string& what, const std::string& hint);

/// From now on SIGBUS, which is what reading a mapped file gives that was cut off meanwhile or whose disk
/// failed, ends the program with an error line that names the file, and exit_input_error, in place of a
/// crash. A device's guardian then takes its force to zero. For programs, not for libraries.
void end_with_an_error_on_shrunk_files();

/// A text or a path, which may come from a file, a device or a person, as `printable` makes it; all else as
/// it is.
template <typename T>
decltype(auto) as_printed(const T& value) {
  if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return printable(value.native());
  } else if constexpr (std::is_convertible_v<const T&, std::string_view>) {
    return printable(value);
  } else {
    return (value);
  }
}

template <typename T>
using AsPrinted = std::remove_cvref_t<decltype(as_printed(std::declval<const T&>()))>;

/// As fmt::print, with each argument `as_printed`: a name cannot do anything to a terminal, nor begin a line.
template <typename... Args>
void say(std::FILE* stream, fmt::format_string<AsPrinted<Args>...> format, const Args&... args) {
  const auto print = [&](const auto&... printed) {
    fmt::vprint(stream, format, fmt::make_format_args(printed...));
  };
  print(as_printed(args)...);
}

/// Prints a text of several lines, each as `printable` makes it, those after the first behind `indent`.
inline void say_lines(std::FILE* stream, std::string_view text, std::string_view indent = "") {
  std::fputs(printable_lines(text, indent).c_str(), stream);
}

}  // namespace palpate
