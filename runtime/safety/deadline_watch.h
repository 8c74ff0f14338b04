// Ticks that come late.
#pragma once

#include <algorithm>

namespace palpate {

struct DeadlineOptions {
  double tolerance = 0.0005;  ///< a tick this late is a miss [s]
  double fade = 0.005;        ///< from whole to no force while ticks are late [s]
  double recovery = 0.1;      ///< back, while they are in time [s]
  double most = 10.0;         ///< misses that are a fault
  double forgiveness = 0.01;  ///< misses that a tick in time makes good: more than one in a hundred adds up
};

/// Scales force down while ticks are late, and counts.
class DeadlineWatch {
 public:
  /// `period`: of the loop [s].
  DeadlineWatch(const DeadlineOptions& options, double period) noexcept
      : options_(options), period_(period) {}

  /// Each tick. `lateness`: of this one [s]; `elapsed` since the one before [s]. A late tick misses as many
  /// as would have come since then.
  void see(double lateness, double elapsed) noexcept {
    if (lateness > options_.tolerance) {
      share_ = std::max(0.0, share_ - std::max(elapsed, period_) / options_.fade);
      misses_ += std::max(1.0, elapsed / period_);
    } else {
      share_ = std::min(1.0, share_ + elapsed / options_.recovery);
      misses_ = std::max(0.0, misses_ - options_.forgiveness);
    }
  }

  [[nodiscard]] double share() const noexcept { return share_; }  ///< of the force [0, 1]
  [[nodiscard]] bool failed() const noexcept { return misses_ >= options_.most; }
  [[nodiscard]] double misses() const noexcept { return misses_; }  ///< that are not forgiven

  void reset() noexcept {
    share_ = 1.0;
    misses_ = 0.0;
  }

 private:
  DeadlineOptions options_;
  double period_;
  double share_ = 1.0;
  double misses_ = 0.0;
};

}  // namespace palpate
