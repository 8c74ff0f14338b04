// What the program prints and writes.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "base/error.h"

namespace palpate {

/// `error` itself where it is an Error, else what it says without a place and a hint.
Error as_error(const std::exception& error);

/// `WHERE: WHAT (HINT)`, without the parts that are empty.
std::string in_one_line(const Error& error);

/// `warning: TEXT` on the error stream, in one piece and over a line that is being renewed there.
void print_warning(std::string_view text);

}  // namespace palpate
