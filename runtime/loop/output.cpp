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

std::string in_one_line(const Error& error) {
  return error.where() + ": " + error.what() + " (" + error.hint() + ")";
}

void print_warning(std::string_view text) {
  const char* over_the_line = isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "";
  const std::string line = fmt::format("{}warning: {}\n", over_the_line, printable(text));
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace palpate
