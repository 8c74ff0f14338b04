// Edit distance, and suggestions for misspelt words.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Smallest number of letters to replace, insert, delete, or swap with a neighbour that turns one word into
/// the other (Damerau-Levenshtein distance, as optimal string alignment: no part is changed twice).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word with the smallest edit_distance. `known` is not empty.
std::string_view nearest(std::string_view word, const std::vector<std::string_view>& known);

/// The known word that `word` is probably a misspelling of: at most one letter in three differs. Nullopt if
/// none is so near. `known` is not empty.
std::optional<std::string> meant(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace palpate
