#include "runtime/safety/buzz_detector.h"

#include <algorithm>

#include "runtime/safety/plausible.h"

namespace palpate {

int FlipCounter::count(const Vec3& signal, std::int64_t now) noexcept {
  for (std::size_t axis = 0; axis < side_.size(); ++axis) {
    const double value = signal[static_cast<Eigen::Index>(axis)];
    const int side = value > amplitude_ ? 1 : value < -amplitude_ ? -1 : 0;
    if (side == 0 || side == side_[axis]) continue;
    const bool flipped = side_[axis] != 0;
    side_[axis] = side;
    if (!flipped) continue;
    times_[next_] = now;
    next_ = (next_ + 1) % times_.size();
    known_ = std::min(known_ + 1, times_.size());
  }
  return static_cast<int>(
      std::count_if(times_.begin(), times_.begin() + static_cast<std::ptrdiff_t>(known_),
                    [&](std::int64_t time) { return seconds_between(time, now) <= window_; }));
}

void BuzzDetector::see(const Vec3& velocity, const Vec3& shown, std::int64_t now, double elapsed) noexcept {
  const bool has_force = shown != Vec3::Zero();
  mean_ += std::min(1.0, elapsed / options_.mean_time) * (shown - mean_);
  const int of_force = force_.count(shown - mean_, now);
  const int of_velocity = velocity_.count(has_force ? velocity : Vec3(Vec3::Zero()), now);
  buzzing_ = std::max(of_force, of_velocity) >= options_.flips;
  share_ = buzzing_ ? std::max(0.0, share_ - elapsed / options_.fade)
                    : std::min(1.0, share_ + elapsed / options_.recovery);
}

}  // namespace palpate
