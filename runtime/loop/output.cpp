#include "runtime/loop/output.h"

#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>

#include "base/printable.h"

namespace palpate {

std::string json_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      quoted += fmt::format("\\u{:04x}", static_cast<int>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string json_vector(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z());
}

Error as_error(const std::exception& error) {
  const auto* known = dynamic_cast<const Error*>(&error);
  return known != nullptr ? *known : Error(error.what(), "", "");
}

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
