#include "runtime/serving/book_files.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/error.h"
#include "base/regular_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t largest_file = 16U << 20U;  // [bytes]

constexpr std::array<std::pair<std::string_view, const char*>, 10> content_types = {{
    {".html", "text/html; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".txt", "text/plain; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".webp", "image/webp"},
    {".gif", "image/gif"},
    {".json", "application/json"},
    {".ttf", "font/ttf"},
}};

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
         c == '-' || c == '/';
}

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.front() != '/' && name.front() != '.' &&
         name.find("/.") == std::string_view::npos && name.find("//") == std::string_view::npos &&
         std::all_of(name.begin(), name.end(), is_name_character);
}

std::string content_type_of(const fs::path& file) {
  const auto* const found = std::find_if(content_types.begin(), content_types.end(), [&](const auto& type) {
    return type.first == file.extension().string();
  });
  return found != content_types.end() ? found->second : "application/octet-stream";
}

bool is_book(const fs::path& folder) {
  std::error_code missing;
  return fs::is_regular_file(folder / "index.html", missing);
}

}  // namespace

fs::path find_book() {
  std::error_code unknown;
  const fs::path program = fs::read_symlink("/proc/self/exe", unknown);
  if (fs::path installed = (program.parent_path() / PALPATE_INSTALLED_BOOK).lexically_normal();
      is_book(installed))
    return installed;
  return is_book(PALPATE_BUILT_BOOK) ? PALPATE_BUILT_BOOK : "";
}

std::optional<BookFile> read_book_file(const fs::path& book, std::string_view name) {
  if (book.empty() || !is_plain_name(name)) return std::nullopt;
  std::error_code missing;
  const fs::path file = fs::canonical(book, missing) / name;
  if (missing || fs::canonical(file, missing) != file || !fs::is_regular_file(file, missing) ||
      fs::file_size(file, missing) > largest_file)
    return std::nullopt;
  try {
    return BookFile{content_type_of(file), read_all(file)};
  } catch (const Error&) {  // no permission, or gone
    return std::nullopt;
  }
}

}  // namespace palpate
