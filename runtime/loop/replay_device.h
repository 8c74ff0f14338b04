// Replay of a recorded session in place of a device.
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "formats/recording.h"
#include "runtime/safety/device.h"

namespace palpate {

/// Comparison of a replay with its session.
struct ReplayDifference {
  std::int64_t ticks = 0;        ///< ticks compared
  std::int64_t different = 0;    ///< ticks whose force, torque or displayed force differs in any bit
  double largest = 0.0;          ///< largest difference of a force [N]
  double largest_time = 0.0;     ///< [s]
  std::int64_t first_tick = -1;  ///< first tick in which a computed field differs; -1: none
  const char* first_field = "";  ///< name of that field in a recording; the first one computed

  /// Adds the comparison of a later run, which began `ticks_before` and `time_before` [s] after this one.
  void add(const ReplayDifference& later, std::int64_t ticks_before, double time_before);
};

/// Returns in each tick the device's input from the session, with its times, so that the loop repeats the
/// session. Ticks are read from the file as they are due: no hand waits for a replay, and a session of hours
/// needs no memory.
class ReplayDevice : public Device {
 public:
  /// `session` must outlive this, and must not be used elsewhere during a run.
  explicit ReplayDevice(const RecordingFile& session) noexcept : session_(session) {}

  [[nodiscard]] std::int64_t ticks() const noexcept { return session_.ticks(); }
  /// Returns the last polled tick as recorded.
  [[nodiscard]] const TickRecord& then() const noexcept { return then_; }
  /// True if a tick could not be read: the run is over.
  [[nodiscard]] bool failed() const noexcept { return failure_ != nullptr; }
  /// Throws the Error of that failure, if any.
  void check() const;

  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  const RecordingFile& session_;
  TickRecord then_;
  std::exception_ptr failure_;
};

/// Adds a tick of the replay, compared with the recorded one, to `difference`.
void compare(const TickRecord& now, const TickRecord& then, ReplayDifference& difference) noexcept;

}  // namespace palpate
