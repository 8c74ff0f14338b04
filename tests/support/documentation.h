// Pages of the book, for tests that try what they show.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/folders.h"

namespace palpate::test {

/// What stands in the fenced blocks of a language on a page: ```toml ... ```
inline std::vector<std::string> fenced_blocks(const std::string& page, const std::string& language) {
  std::ifstream lines(source_file(page));
  std::vector<std::string> blocks;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) {
      inside = !inside && line == "```" + language;
      if (inside) blocks.emplace_back();
    } else if (inside) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

}  // namespace palpate::test
