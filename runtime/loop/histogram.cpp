#include "runtime/loop/histogram.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr std::int64_t fine_end = 1'000'000;        // ns
constexpr std::int64_t coarse_step = 1000;          // ns
constexpr std::int64_t coarse_end = 1'000'000'000;  // ns

}  // namespace

TimeHistogram::TimeHistogram() : fine_(fine_end), coarse_((coarse_end - fine_end) / coarse_step) {}

void TimeHistogram::add(std::int64_t nanoseconds) noexcept {
  const std::int64_t duration = std::max<std::int64_t>(nanoseconds, 0);
  ++total_;
  worst_ = std::max(worst_, duration);
  if (duration < fine_end) {
    ++fine_[static_cast<std::size_t>(duration)];
  } else if (duration < coarse_end) {
    ++coarse_[static_cast<std::size_t>((duration - fine_end) / coarse_step)];
  } else {
    ++longer_;
  }
}

void TimeHistogram::clear() noexcept {
  std::fill(fine_.begin(), fine_.end(), 0);
  std::fill(coarse_.begin(), coarse_.end(), 0);
  longer_ = total_ = worst_ = 0;
}

std::int64_t TimeHistogram::percentile(double fraction) const noexcept {
  const auto wanted = static_cast<std::int64_t>(std::ceil(fraction * static_cast<double>(total_)));
  std::int64_t seen = 0;
  for (std::size_t ns = 0; ns < fine_.size(); ++ns) {
    seen += fine_[ns];
    if (seen >= wanted) return static_cast<std::int64_t>(ns);
  }
  for (std::size_t us = 0; us < coarse_.size(); ++us) {
    seen += coarse_[us];
    if (seen >= wanted) return std::min(worst_, fine_end + static_cast<std::int64_t>(us + 1) * coarse_step);
  }
  return worst_;
}

std::int64_t TimeHistogram::total_between(std::int64_t from, std::int64_t to) const noexcept {
  std::int64_t total = to > worst_ ? longer_ : 0;
  for (std::int64_t ns = std::max<std::int64_t>(from, 0); ns < std::min(to, fine_end); ++ns)
    total += fine_[static_cast<std::size_t>(ns)];
  const std::int64_t first = (std::clamp(from, fine_end, coarse_end) - fine_end) / coarse_step;
  const std::int64_t end = (std::clamp(to, fine_end, coarse_end) - fine_end) / coarse_step;
  for (std::int64_t us = first; us < end; ++us) total += coarse_[static_cast<std::size_t>(us)];
  return total;
}

}  // namespace palpate
