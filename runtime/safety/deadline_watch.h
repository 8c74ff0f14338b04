// Detection of late ticks.
#pragma once

#include <algorithm>

namespace palpate {

struct DeadlineOptions {
  double tolerance = 0.0005;  ///< lateness above which a tick counts as a miss [s]
  double fade = 0.005;        ///< time from full to no force while ticks are late [s]
  double recovery = 0.1;      ///< time back to full force once they are on time [s]
  double most = 10.0;         ///< number of misses that is a fault
  double forgiveness = 0.01;  ///< misses forgiven per tick on time: more than one late tick in a hundred adds
                              ///< up
};

/// Scales the force down while ticks are late and counts the misses.
class DeadlineWatch {
 public:
  /// `period`: period of the loop [s].
  DeadlineWatch(const DeadlineOptions& options, double period) noexcept
      : options_(options), period_(period) {}

  /// Updates the watch; call once per tick. `lateness` is that of this tick [s], `elapsed` the time since the
  /// last one [s]. A late tick counts as elapsed / period misses, at least one.
  void see(double lateness, double elapsed) noexcept {
    if (lateness > options_.tolerance) {
      share_ = std::max(0.0, share_ - std::max(elapsed, period_) / options_.fade);
      misses_ += std::max(1.0, elapsed / period_);
    } else {
      share_ = std::min(1.0, share_ + elapsed / options_.recovery);
      misses_ = std::max(0.0, misses_ - options_.forgiveness);
    }
  }

  [[nodiscard]] double share() const noexcept { return share_; }  ///< factor on the force [0, 1]
  [[nodiscard]] bool failed() const noexcept { return misses_ >= options_.most; }
  [[nodiscard]] double misses() const noexcept { return misses_; }  ///< misses not yet forgiven

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
