// One check of `palpate-precompute verify`.
#pragma once

#include <string>

namespace palpate {

/// Its largest relative error and the bound that it must keep.
struct Check {
  std::string name;
  double error = 0.0;
  double bound = 0.0;
  [[nodiscard]] bool passed() const noexcept { return error <= bound; }  // false for NaN too
};

}  // namespace palpate
