// Detection of a device that moves faster than a hand.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/safety/plausible.h"

namespace palpate {

/// Speed of the device: the larger of the reported velocity and the distance moved per time. The second
/// catches an encoder that jumps.
class SpeedLimit {
 public:
  /// `most`: largest speed [m/s]; `period`: time between reports [s].
  SpeedLimit(double most, double period) noexcept : most_(most), period_(period) {}

  /// Updates the speed; call for each new report.
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
  /// Time since the last report [s]. A report may have been delayed on its way, so its sequence number counts
  /// too.
  [[nodiscard]] double time(const DeviceState& report) const noexcept {
    constexpr std::uint32_t most_lost = 20;  // a longer gap is silence
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
