#include "docs/describe/markdown.h"

#include <algorithm>
#include <regex>
#include <sstream>

namespace palpate {
namespace {

constexpr std::size_t widest = 110;  // bytes of a line

std::string line(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& text_of_cell : cells)
    text += (text_of_cell.empty() ? " |" : " " + text_of_cell + " |");
  return text + "\n";
}

std::vector<std::string> kept(const std::vector<std::string>& cells, const std::vector<bool>& keep) {
  std::vector<std::string> result;
  for (std::size_t column = 0; column < cells.size(); ++column)
    if (keep[column]) result.push_back(cells[column]);
  return result;
}

}  // namespace

std::string cell(const std::string& text) {
  const std::string one_line = std::regex_replace(text, std::regex("\\s+"), " ");
  return std::regex_replace(one_line, std::regex("\\|"), "\\|");
}

std::string code(const std::string& text) {
  return text.empty() ? "" : "`" + text + "`";
}

std::string with_options_as_code(const std::string& text) {
  return std::regex_replace(text, std::regex("(^|[ (])(--[a-z][a-z-]*)"), "$1`$2`");
}

std::string markdown_table(const std::vector<std::string>& titles,
                           const std::vector<std::vector<std::string>>& rows) {
  std::vector<bool> keep(titles.size());
  for (std::size_t column = 0; column < titles.size(); ++column)
    keep[column] = std::ranges::any_of(rows, [&](const auto& row) { return !row[column].empty(); });
  const std::vector<std::string> heads = kept(titles, keep);
  std::string text = line(heads) + "|";
  for (std::size_t column = 0; column < heads.size(); ++column) text += "---|";
  text += "\n";
  for (std::vector<std::string> row : rows) {
    std::ranges::transform(row, row.begin(), cell);
    text += line(kept(row, keep));
  }
  return text + "\n";
}

std::string with_short_lines(const std::string& text) {
  std::string result;
  std::istringstream lines(text);
  for (std::string one; std::getline(lines, one);) {
    const std::size_t most = one.starts_with('|') || one.starts_with('#') ? one.size() : widest;
    while (one.size() > most) {
      const std::size_t space = std::min(one.rfind(' ', most), one.find(' ', most));
      if (space == std::string::npos) break;
      result += one.substr(0, space) + "\n";
      one.erase(0, space + 1);
    }
    result += one + "\n";
  }
  return result.substr(0, result.find_last_not_of('\n') + 1) + "\n";
}

}  // namespace palpate
