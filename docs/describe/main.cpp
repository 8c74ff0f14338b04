// palpate-describe FOLDER: writes the pages of the book's reference into a folder.
#include <fmt/core.h>

#include <filesystem>

#include "base/error.h"
#include "base/program.h"
#include "base/write_file.h"
#include "docs/describe/pages.h"

namespace {

using namespace palpate;

int describe(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const Page& page : reference_pages()) {
    write_file(folder / (page.name + ".md"), page.text);
    fmt::print("{}\n", (folder / (page.name + ".md")).string());
  }
  return exit_ok;
}

}  // namespace

int main(int count, char** words) {
  return palpate::run_program("palpate-describe", "close other programs", [&] {
    if (count != 2) return palpate::tell_usage("one folder is needed", "palpate-describe docs/reference");
    return describe(words[1]);
  });
}
