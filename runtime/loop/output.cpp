#include "runtime/loop/output.h"

#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>

#include "base/error.h"
#include "base/printable.h"

namespace palpate {

std::string in_one_line(const Error& error) {
  const std::string where = error.where().empty() ? "" : error.where() + ": ";
  return where + error.what() + (error.hint().empty() ? "" : " (" + error.hint() + ")");
}

void print_warning(std::string_view text) {
  const char* over_the_line = isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "";
  const std::string line = fmt::format("{}warning: {}\n", over_the_line, printable(text));
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace palpate
