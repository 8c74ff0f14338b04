// Files of the book, served for the viewer's help.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace palpate {

/// Returns the folder of the book's site: the one installed with this program, otherwise the one built by
/// scripts/docs in this program's source tree. Empty if there is neither.
std::filesystem::path find_book();

/// File of the site with its content type.
struct BookFile {
  std::string content_type;
  std::string bytes;
};

/// Reads the file that an address names ("tutorials/push-a-liver.html"). Empty unless it is a regular file
/// below `book`, not reached through a link, of at most 16 MB. A name consists of letters, digits and `. _ -
/// /`, and no component begins with a dot.
std::optional<BookFile> read_book_file(const std::filesystem::path& book, std::string_view name);

}  // namespace palpate
