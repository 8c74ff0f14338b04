#include "runtime/histogram.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr std::size_t longest_ns = 1'000'000;
}

TimeHistogram::TimeHistogram() : counts_(longest_ns + 1) {}

void TimeHistogram::add(std::int64_t nanoseconds) noexcept {
  ++total_;
  worst_ = std::max(worst_, nanoseconds);
  if (nanoseconds >= 0 && static_cast<std::size_t>(nanoseconds) < counts_.size()) {
    ++counts_[static_cast<std::size_t>(nanoseconds)];
  }
}

std::int64_t TimeHistogram::percentile(double fraction) const noexcept {
  const auto wanted = static_cast<std::int64_t>(std::ceil(fraction * static_cast<double>(total_)));
  std::int64_t seen = 0;
  for (std::size_t ns = 0; ns < counts_.size(); ++ns) {
    seen += counts_[ns];
    if (seen >= wanted) return static_cast<std::int64_t>(ns);
  }
  return worst_;
}

}  // namespace palpate
