// How far words are from each other.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// The fewest letters that are to be replaced, added or left out, or exchanged with their neighbour, to make
/// one word of the other (the distance of Damerau and Levenshtein, no part changed twice).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word, of at least one, that takes the fewest changes of a letter (edit_distance).
std::string_view nearest(std::string_view word, const std::vector<std::string_view>& known);

/// The known word, of at least one, that `word` is probably a slip of the pen from: at most one letter in
/// three is another. Nothing where none is so near.
std::optional<std::string> meant(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace palpate
