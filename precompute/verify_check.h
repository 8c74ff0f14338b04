// One check of `palpate-precompute verify`.
#pragma once

#include <string>

namespace palpate {

/// Largest relative error of a check, and its bound.
struct Check {
  std::string name;
  double error = 0.0;
  double bound = 0.0;
  [[nodiscard]] bool passed() const noexcept { return error <= bound; }  // false for NaN too
};

}  // namespace palpate
