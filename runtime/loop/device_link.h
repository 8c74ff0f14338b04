// Connects the loop to a device through two threads, so that the loop never waits for the device.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "base/latest.h"
#include "runtime/safety/clamps.h"
#include "runtime/safety/device_port.h"
#include "runtime/safety/safety_options.h"

namespace palpate {

struct DeviceLinkOptions {
  /// Largest force computed by the writer itself, if the device allows it [N].
  double max_force = SafetyOptions{}.max_force;
  double max_force_rate = SafetyOptions{}.max_force_rate;  ///< [N/s]
  StaleOptions stale{};  ///< lifetime and damping of the loop's solutions, when no new one arrives
};

/// Device with a reader and a writer thread. The reader passes on the latest report, and reopens a lost
/// device once it is back. The writer sends each command of the loop as soon as it is available. If the last
/// command is older than 2 ms (the loop may hang), the writer continues alone: the last solution as a force
/// field, force - K (x - point) - b v at the device's current position, within its radius and time to live,
/// then it fades; it never holds a force. Both threads request real-time scheduling, just below the loop's.
class DeviceLink : public Device {
 public:
  /// Opens the device. Throws Error with the reason if that fails.
  DeviceLink(std::unique_ptr<DevicePort> port, const DeviceLinkOptions& options);
  /// Sets the force to zero, then closes.
  ~DeviceLink() override;
  DeviceLink(const DeviceLink&) = delete;
  DeviceLink& operator=(const DeviceLink&) = delete;

  /// True once the device has sent a report.
  [[nodiscard]] bool has_reported() const noexcept { return reports_ > 0; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }  ///< name at the first opening
  [[nodiscard]] DeviceLimits limits() const { return port_->limits(); }
  [[nodiscard]] std::string refusals() const { return port_->refusals(); }

  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand& command, const DeviceState& state, std::int64_t begun) noexcept override;

  [[nodiscard]] std::int64_t reports() const noexcept { return reports_; }            ///< reports so far
  [[nodiscard]] std::int64_t writes() const noexcept { return writes_; }              ///< writes so far
  [[nodiscard]] std::int64_t worst_write() const noexcept { return worst_write_; }    ///< [ns]
  [[nodiscard]] std::int64_t extrapolated() const noexcept { return extrapolated_; }  ///< extrapolated writes

 private:
  /// Command of the loop and the state that it was computed from.
  struct Shown {
    DeviceCommand command;
    DeviceState state;
    std::int64_t begun = 0;  // start of the tick [ns]
  };

  void read_reports() noexcept;
  void lose() noexcept;
  void try_to_open() noexcept;
  void write_commands() noexcept;
  void write(const DeviceCommand& command, const DeviceState& state) noexcept;
  [[nodiscard]] DeviceCommand extrapolate(const Shown& shown, const DeviceState& state, std::int64_t now,
                                          double elapsed) noexcept;

  std::unique_ptr<DevicePort> port_;
  DeviceLinkOptions options_;
  std::string name_;

  // From the reader to the loop and the writer.
  Latest<DeviceState> heard_;
  Latest<DeviceState> heard_by_writer_;
  std::atomic<std::int64_t> reports_ = 0;
  std::atomic<std::int64_t> losses_ = 0;
  std::atomic<std::int64_t> openings_ = 1;  // openings that were followed by a report
  // Used by the loop alone.
  std::int64_t losses_told_ = 0;
  std::int64_t openings_told_ = 1;

  // From the loop to the writer.
  Latest<Shown> shown_;
  sem_t is_shown_;
  std::atomic<std::int64_t> writes_ = 0;
  std::atomic<std::int64_t> worst_write_ = 0;
  std::atomic<std::int64_t> extrapolated_ = 0;
  StaleSolution stale_;  // used by the writer
  RateClamp rate_;       // used by the writer

  std::mutex wire_;                   // held while the writer writes, or the reader closes and opens
  bool is_open_ = true;               // guarded by wire_
  std::atomic<bool> broken_ = false;  // a write failed
  std::atomic<bool> stop_ = false;
  std::thread reader_;
  std::thread writer_;
};

}  // namespace palpate
