// Units of length of files.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace palpate {

/// A unit of length.
struct LengthUnit {
  std::string name;     ///< "mm", or "1 unit = 0.1 m" without a name
  double metres = 1.0;  ///< [m] per unit
};

/// Spellings of units, for help.
inline constexpr const char* unit_choices = "m|cm|mm|um|in|METRES";

/// Reads a unit's name, or metres per unit. Nullopt if it is neither.
std::optional<LengthUnit> read_unit(std::string_view text);

/// A unit inferred from a size.
struct UnitGuess {
  LengthUnit unit;
  std::string why;  ///< a clause, for "the unit is ..."
};

/// Unit guessed from the longest side of a body > 0 [file units], by typical sizes of organs and samples: the
/// first of mm, m and cm that makes it 2 cm to 50 cm (mm: to 2 m) long; if none does, the power of ten of a
/// metre that makes it 10 cm to 1 m long.
UnitGuess guess_unit(double longest_side);

/// A length in everyday units: "15 cm", "3.1 mm".
std::string length_text(double metres);

}  // namespace palpate
