// A device that says nothing, or always the same.
#pragma once

#include <cstdint>

#include "runtime/safety/device.h"

namespace palpate {

struct SilenceOptions {
  double most = 0.020;        ///< without a new report: a fault [s]
  double fade_from = 0.005;   ///< the force fades from here, to nothing at `most` [s]
  double frozen = 0.25;       ///< with the same numbers in every report, while force is shown: a fault [s]
  double frozen_force = 0.1;  ///< a device may rest: only above this force must the hand be seen to move [N]
};

/// A report is new when its sequence number is ahead of the last one's and its numbers are plausible.
class SilenceWatch {
 public:
  explicit SilenceWatch(const SilenceOptions& options) noexcept : options_(options) {}

  /// Each tick: true when `device` is a new report. `shown`: the size of the force that the hand has [N].
  bool observe(const DeviceState& device, std::int64_t now, double shown) noexcept;

  /// The share of the force [0, 1].
  [[nodiscard]] double share() const noexcept;
  [[nodiscard]] bool silent() const noexcept { return silence_ > options_.most; }
  [[nodiscard]] bool frozen() const noexcept { return frozen_ > options_.frozen; }

  /// As if nothing had been heard yet: any report is new.
  void reset() noexcept { *this = SilenceWatch(options_); }

 private:
  SilenceOptions options_;
  DeviceState last_;
  std::int64_t heard_ = 0;        // when [ns]
  std::int64_t seen_moving_ = 0;  // when [ns]
  double silence_ = 0.0;          // [s]
  double frozen_ = 0.0;           // [s]
  bool heard_anything_ = false;
  bool started_ = false;
};

}  // namespace palpate
