// What the program prints and writes.
#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace palpate {

/// `WHERE: WHAT (HINT)` of an Error; of another exception what it says.
std::string in_one_line(const std::exception& error);

/// `warning: TEXT` on the error stream, in one piece and over a line that is being renewed there.
void print_warning(std::string_view text);

}  // namespace palpate
