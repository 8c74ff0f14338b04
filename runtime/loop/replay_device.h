// A recorded session in place of a hand.
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "formats/recording.h"
#include "runtime/safety/device.h"

namespace palpate {

/// How a replay compares with its session.
struct ReplayDifference {
  std::int64_t ticks = 0;        ///< compared
  std::int64_t different = 0;    ///< whose force, torque or shown force is not the same in every bit
  double largest = 0.0;          ///< difference of a force [N]
  double largest_time = 0.0;     ///< [s]
  std::int64_t first_tick = -1;  ///< in which anything that a tick computes is not the same; -1: none
  const char* first_field = "";  ///< what it is, as a recording names it: of several what is computed first

  /// Takes in that of a run which began `ticks_before` and `time_before` [s] after this one.
  void add(const ReplayDifference& later, std::int64_t ticks_before, double time_before);
};

/// Says in each tick what the device said in the session, with its times, so that the loop does all of it
/// again. Ticks are read from the file as they are due: nobody feels a replay, and a session of hours takes
/// no memory.
class ReplayDevice : public Device {
 public:
  /// `session` must live as long; nobody else uses it during a run.
  explicit ReplayDevice(const RecordingFile& session) noexcept : session_(session) {}

  [[nodiscard]] std::int64_t ticks() const noexcept { return session_.ticks(); }
  /// The tick that was polled last, as it was then.
  [[nodiscard]] const TickRecord& then() const noexcept { return then_; }
  /// Whether a tick could not be read any more: the run is over.
  [[nodiscard]] bool failed() const noexcept { return failure_ != nullptr; }
  /// Throws the Error why.
  void check() const;

  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  const RecordingFile& session_;
  TickRecord then_;
  std::exception_ptr failure_;
};

/// Takes note of how a tick of the replay differs from the same one then.
void compare(const TickRecord& now, const TickRecord& then, ReplayDifference& difference) noexcept;

}  // namespace palpate
