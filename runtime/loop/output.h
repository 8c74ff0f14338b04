// Text output of the program.
#pragma once

#include <string>
#include <string_view>

#include "base/error.h"

namespace palpate {

/// Formats `WHERE: WHAT (HINT)`, without the parts that are empty.
std::string in_one_line(const Error& error);

/// Prints `warning: TEXT` to the error stream, in one write, over a line that is being renewed there.
void print_warning(std::string_view text);

}  // namespace palpate
