// Connection to a device, as used by the device's two threads.
#pragma once

#include <string>

#include "runtime/safety/device.h"

namespace palpate {

/// Connection to a HID device or to another process. One thread opens, reads and closes; another one writes
/// in between. The tick never calls it. A lost device may be closed and opened again.
class DevicePort {
 public:
  enum class ReadResult {
    report,   ///< a new report
    nothing,  ///< no report within the waiting time, or none that is valid
    lost,     ///< unplugged or broken: close, and open again once it is back
  };

  virtual ~DevicePort() = default;

  /// Opens the device, also after a close, and prepares it to display forces. Throws Error with the reason
  /// and a hint.
  virtual void open() = 0;

  /// Waits at most 10 ms for a report and keeps the newest. On success fills `state`: device frame, with
  /// velocity, time of arrival (CLOCK_MONOTONIC) and sequence number. Otherwise leaves it unchanged.
  virtual ReadResult read(DeviceState& state) noexcept = 0;

  /// Displays a command computed from `state`; false if the device is lost. May block for milliseconds.
  virtual bool write(const DeviceCommand& command, const DeviceState& state) noexcept = 0;

  /// Sets the force to zero, then closes. Must not run during read or write. Does nothing if the device is
  /// not open.
  virtual void close() noexcept = 0;

  /// Limits of the device; known once it has been opened.
  [[nodiscard]] virtual DeviceLimits limits() const = 0;

  /// Text on rejected input: "3 of a wrong size, 1 too old"; empty if there was none. May be called from any
  /// thread.
  [[nodiscard]] virtual std::string refusals() const = 0;

  /// Name for messages: profile, ids, path.
  [[nodiscard]] virtual std::string name() const = 0;
};

}  // namespace palpate
