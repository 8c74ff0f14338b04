#include "base/spelling.h"

#include <algorithm>
#include <numeric>

#include "base/words.h"

namespace palpate {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::optional<std::string> meant(std::string_view word, const std::vector<std::string_view>& known) {
  const std::string_view best = nearest(word, known);
  const std::size_t most = std::max<std::size_t>(1, word.size() / 3);
  return edit_distance(word, best) <= most ? std::optional(std::string(best)) : std::nullopt;
}

}  // namespace palpate
