// Ranges of valid numbers, with words for messages.
#pragma once

#include <limits>
#include <string_view>

namespace palpate {

/// An interval of numbers.
struct NumberRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool has_low = false, has_high = false;  ///< the bound itself is included
  std::string_view words = "finite";       ///< the condition on a number, in words

  [[nodiscard]] constexpr bool contains(double x) const noexcept {
    return (x > low || (has_low && x == low)) && (x < high || (has_high && x == high));
  }
};

inline constexpr NumberRange any_number{};
inline constexpr NumberRange positive_number{.low = 0.0, .words = "greater than 0"};
inline constexpr NumberRange number_from_zero{.low = 0.0, .has_low = true, .words = "0 or more"};

}  // namespace palpate
