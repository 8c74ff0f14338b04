#include "runtime/safety/silence_watch.h"

#include <algorithm>

#include "runtime/safety/plausible.h"

namespace palpate {
namespace {

/// True if `sequence` is ahead of `of`; sequence numbers wrap around.
bool is_ahead(std::uint32_t sequence, std::uint32_t of) noexcept {
  return static_cast<std::int32_t>(sequence - of) > 0;
}

bool same_numbers(const DeviceState& a, const DeviceState& b) noexcept {
  return a.pose.position == b.pose.position && a.pose.orientation.coeffs() == b.pose.orientation.coeffs() &&
         a.velocity == b.velocity;
}

}  // namespace

bool SilenceWatch::observe(const DeviceState& device, std::int64_t now, double shown) noexcept {
  if (!started_) {
    started_ = true;
    heard_ = now;
    seen_moving_ = now;
  }
  const bool is_new = is_plausible(device) && (!heard_anything_ || is_ahead(device.sequence, last_.sequence));
  const bool is_same = heard_anything_ && same_numbers(device, last_);
  if (is_new) {
    heard_ = device.arrived;
    heard_anything_ = true;
    last_ = device;
  }
  if ((is_new && !is_same) || !(shown > options_.frozen_force)) seen_moving_ = now;
  silence_ = std::max(0.0, seconds_between(heard_, now));
  frozen_ = std::max(0.0, seconds_between(seen_moving_, now));
  return is_new;
}

double SilenceWatch::share() const noexcept {
  if (!heard_anything_) return 0.0;
  return std::clamp((options_.most - silence_) / (options_.most - options_.fade_from), 0.0, 1.0);
}

}  // namespace palpate
