// The documentation, for tests that hold tables of the code against it.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

namespace palpate::test {

/// README.md, the pages of docs/ and the devices' page, one after the other.
inline std::string documentation() {
  const std::filesystem::path root = PALPATE_SOURCE_DIR;
  std::ostringstream text;
  const auto add = [&text](const std::filesystem::path& page) {
    text << std::ifstream(page).rdbuf() << "\n";
  };
  add(root / "README.md");
  add(root / "runtime/devices/README.md");
  for (const auto& page : std::filesystem::directory_iterator(root / "docs"))
    if (page.path().extension() == ".md") add(page.path());
  return text.str();
}

/// A table's row stands in `pages` as a line of its own.
inline bool has_row(const std::string& pages, const std::string& row) {
  return pages.find("\n" + row + "\n") != std::string::npos;
}

}  // namespace palpate::test
