// Text output of the program.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "base/error.h"

namespace palpate {

/// Returns `error` itself if it is an Error, otherwise an Error with its text and without place and hint.
Error as_error(const std::exception& error);

/// Formats `WHERE: WHAT (HINT)`, without the parts that are empty.
std::string in_one_line(const Error& error);

/// Prints `warning: TEXT` to the error stream, in one write, over a line that is being renewed there.
void print_warning(std::string_view text);

}  // namespace palpate
