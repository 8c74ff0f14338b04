#include "runtime/output.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

#include "meshes/error.h"
#include "meshes/printable.h"

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

void write_text_file(const std::filesystem::path& file, std::string_view text) {
  const std::filesystem::path partial = file.string() + ".partial";
  std::ofstream stream(partial, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  std::error_code failed;
  std::string reason;
  if (stream) {
    std::filesystem::rename(partial, file, failed);
    if (!failed) return;
    reason = failed.message();
  } else {
    reason = std::strerror(errno);
  }
  std::filesystem::remove(partial, failed);
  throw Error(fmt::format("cannot be written: {}", reason), file.string(),
              "check the folder, its rights and the free space");
}

void print_warning(std::string_view text) {
  fmt::print(stderr, "warning: {}\n", printable(text));
}

}  // namespace palpate
