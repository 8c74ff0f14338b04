#include "statics/range_of_errors.h"

#include <cmath>
#include <cstddef>

namespace palpate {

double range_within(std::span<const double> rotation, std::span<const double> errors, double most) noexcept {
  double last = 0.0, before = 0.0;
  for (std::size_t k = 0; k < rotation.size(); ++k) {
    const double error = std::abs(errors[k]);
    if (!(error <= most)) {
      if (!std::isfinite(error)) return last;  // not interpolated
      return last + (most - before) / (error - before) * (rotation[k] - last);
    }
    last = rotation[k];
    before = error;
  }
  return last;
}

}  // namespace palpate
