// Detection of a device that sends nothing, or always the same numbers.
#pragma once

#include <cstdint>

#include "runtime/safety/device.h"

namespace palpate {

struct SilenceOptions {
  double most = 0.020;        ///< time without a new report that is a fault [s]
  double fade_from = 0.005;   ///< time without a new report after which the force fades, to zero at `most`
                              ///< [s]
  double frozen = 0.25;       ///< time with the same numbers in every report, while force is displayed, that
                              ///< is a fault [s]
  double frozen_force = 0.1;  ///< force above which the hand must be seen to move [N]; below it a device may
                              ///< rest
};

/// Detects silent and frozen devices. A report is new if its sequence number is ahead of the last one's and
/// its numbers are plausible.
class SilenceWatch {
 public:
  explicit SilenceWatch(const SilenceOptions& options) noexcept : options_(options) {}

  /// Updates the watch; call once per tick. Returns true if `device` is a new report. `shown`: magnitude of
  /// the force on the hand [N].
  bool observe(const DeviceState& device, std::int64_t now, double shown) noexcept;

  /// Factor on the force [0, 1].
  [[nodiscard]] double share() const noexcept;
  [[nodiscard]] bool silent() const noexcept { return silence_ > options_.most; }
  [[nodiscard]] bool frozen() const noexcept { return frozen_ > options_.frozen; }

  /// Forgets all reports: the next plausible one is new.
  void reset() noexcept { *this = SilenceWatch(options_); }

 private:
  SilenceOptions options_;
  DeviceState last_;
  std::int64_t heard_ = 0;        // time of the last new report [ns]
  std::int64_t seen_moving_ = 0;  // time of the last motion, or of the last tick below frozen_force [ns]
  double silence_ = 0.0;          // [s]
  double frozen_ = 0.0;           // [s]
  bool heard_anything_ = false;
  bool started_ = false;
};

}  // namespace palpate
