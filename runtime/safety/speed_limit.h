// A device that moves faster than a hand.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/safety/plausible.h"

namespace palpate {

/// The speed of the device, by what it says and by how far it came: an encoder that jumps says nothing of it.
class SpeedLimit {
 public:
  /// `most` [m/s]; `period` of the reports [s].
  SpeedLimit(double most, double period) noexcept : most_(most), period_(period) {}

  /// Each new report.
  void see(const DeviceState& report) noexcept {
    speed_ = report.velocity.norm();
    if (has_last_)
      speed_ = std::max(speed_, (report.pose.position - last_.pose.position).norm() / time(report));
    last_ = report;
    has_last_ = true;
  }

  [[nodiscard]] bool failed() const noexcept { return !(speed_ <= most_); }
  [[nodiscard]] double speed() const noexcept { return speed_; }  ///< [m/s]

  void reset() noexcept { *this = SpeedLimit(most_, period_); }

 private:
  /// Since the last report: it may have been delayed on its way, so by its number too, [s].
  [[nodiscard]] double time(const DeviceState& report) const noexcept {
    constexpr std::uint32_t most_lost = 20;  // more is silence
    const double reports = std::min(report.sequence - last_.sequence, most_lost);
    return std::max({seconds_between(last_.arrived, report.arrived), reports * period_, period_});
  }

  double most_;
  double period_;
  DeviceState last_;
  double speed_ = 0.0;
  bool has_last_ = false;
};

}  // namespace palpate
