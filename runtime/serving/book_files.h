// The book, for whoever opens it from the viewer's help.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace palpate {

/// Folder of the book's site: the one installed with this program, else the one that scripts/docs has built
/// in this program's source tree. Empty where there is neither.
std::filesystem::path find_book();

/// A file of the site, as a browser is to take it.
struct BookFile {
  std::string content_type;
  std::string bytes;
};

/// The file that an address names ("tutorials/push-a-liver.html"), if it is one of the site: a regular file
/// below `book` that no link leads to, of at most 16 MB. A name has letters, digits and `. _ - /` only, and
/// no part of it begins with a dot.
std::optional<BookFile> read_book_file(const std::filesystem::path& book, std::string_view name);

}  // namespace palpate
