#include "runtime/loop/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace palpate {
namespace {

// Octave k, of durations in [500, 1000) 2^k ns, has 500 steps of 2^k ns; before the first one there are 500
// of 1 ns.
constexpr std::int64_t octave_steps = 500;
constexpr std::int64_t octaves = 21;
constexpr std::int64_t counted_end = octave_steps << octaves;  // ns

std::int64_t step_of(std::int64_t duration) noexcept {
  if (duration < octave_steps) return duration;
  const auto octave = std::bit_width(static_cast<std::uint64_t>(duration / octave_steps)) - 1;
  return octave_steps * octave + (duration >> octave);
}

/// Longest duration counted in a step [ns].
std::int64_t last_of(std::int64_t step) noexcept {
  if (step < octave_steps) return step;
  const std::int64_t octave = step / octave_steps - 1;
  return ((step - octave_steps * octave + 1) << octave) - 1;
}

}  // namespace

TimeHistogram::TimeHistogram() : counts_(octave_steps * (octaves + 1)) {}

void TimeHistogram::add(std::int64_t nanoseconds) noexcept {
  const std::int64_t duration = std::max<std::int64_t>(nanoseconds, 0);
  ++total_;
  worst_ = std::max(worst_, duration);
  if (duration < counted_end) {
    ++counts_[static_cast<std::size_t>(step_of(duration))];
  } else {
    ++longer_;
  }
}

void TimeHistogram::add(const TimeHistogram& other) noexcept {
  for (std::size_t step = 0; step < counts_.size(); ++step) counts_[step] += other.counts_[step];
  longer_ += other.longer_;
  total_ += other.total_;
  worst_ = std::max(worst_, other.worst_);
}

void TimeHistogram::clear() noexcept {
  std::fill(counts_.begin(), counts_.end(), 0);
  longer_ = total_ = worst_ = 0;
}

std::int64_t TimeHistogram::percentile(double fraction) const noexcept {
  const auto wanted = static_cast<std::int64_t>(std::ceil(fraction * static_cast<double>(total_)));
  std::int64_t seen = 0;
  for (std::size_t step = 0; step < counts_.size(); ++step) {
    seen += counts_[step];
    if (seen >= wanted) return std::min(worst_, last_of(static_cast<std::int64_t>(step)));
  }
  return worst_;
}

std::int64_t TimeHistogram::total_between(std::int64_t from, std::int64_t to) const noexcept {
  std::int64_t total = to > worst_ ? longer_ : 0;
  const std::int64_t first = step_of(std::clamp<std::int64_t>(from, 0, counted_end));
  const std::int64_t past = step_of(std::clamp<std::int64_t>(to, 0, counted_end));
  for (std::int64_t step = first; step < past; ++step) total += counts_[static_cast<std::size_t>(step)];
  return total;
}

}  // namespace palpate
