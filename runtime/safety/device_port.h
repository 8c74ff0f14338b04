// A device as its two threads see it.
#pragma once

#include <string>

#include "runtime/safety/device.h"

namespace palpate {

/// The wire to a device: a HID device, another process. One thread opens, reads and closes, another one
/// writes in between; the tick never comes here. After a device was lost it may be closed and opened again.
class DevicePort {
 public:
  enum class ReadResult {
    report,   ///< a new one
    nothing,  ///< in the time that a read waits, or nothing that makes sense
    lost,     ///< unplugged or broken: close, and open again when it is back
  };

  virtual ~DevicePort() = default;

  /// Opens the device, again after a close, and does what it needs before it can show forces. Throws Error
  /// that says why not and what to do.
  virtual void open() = 0;

  /// Waits for a report for at most 10 ms and takes the newest. Fills `state`: in the device's frame, with
  /// velocity, time of arrival (CLOCK_MONOTONIC) and number. Otherwise leaves it as it is.
  virtual ReadResult read(DeviceState& state) noexcept = 0;

  /// Shows a command that follows from `state`; false when the device is lost. May block for milliseconds.
  virtual bool write(const DeviceCommand& command, const DeviceState& state) noexcept = 0;

  /// No force, then closes. Neither read nor write is running. Does nothing when it is not open.
  virtual void close() noexcept = 0;

  /// What the device can bear; known once it was open.
  [[nodiscard]] virtual DeviceLimits limits() const = 0;

  /// What came and was not taken, for a person: "3 of a wrong size, 1 too old"; empty: nothing. From any
  /// thread.
  [[nodiscard]] virtual std::string refusals() const = 0;

  /// What a person calls it: profile, ids, path.
  [[nodiscard]] virtual std::string name() const = 0;
};

}  // namespace palpate
