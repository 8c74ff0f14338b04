// Joins the loop to a device by two threads, so that the loop never waits for the wire.
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
  /// The largest force that the writer works out itself, where the device bears it [N].
  double max_force = SafetyOptions{}.max_force;
  double max_force_rate = SafetyOptions{}.max_force_rate;  ///< [N/s]
  StaleOptions stale{};  ///< of the loop's solutions, when it gives no new ones
};

/// A device with a reader and a writer thread. The reader hands over the latest report, and opens the device
/// again when it was lost and is back. The writer writes what the loop shows as soon as it is there. When
/// that is older than 2 ms (the loop may hang), the writer goes on by itself: the last solution as a
/// field, force - K (x - point) - b v at where the device is now, within its radius and time to live, then it
/// fades; it never holds a force. Both threads ask for real-time scheduling, a little below the loop's.
class DeviceLink : public Device {
 public:
  /// Opens the device. Throws Error that says why it cannot be.
  DeviceLink(std::unique_ptr<DevicePort> port, const DeviceLinkOptions& options);
  /// No force, then closes.
  ~DeviceLink() override;
  DeviceLink(const DeviceLink&) = delete;
  DeviceLink& operator=(const DeviceLink&) = delete;

  /// Whether the device has said anything yet.
  [[nodiscard]] bool has_reported() const noexcept { return reports_ > 0; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }  ///< when it was opened first
  [[nodiscard]] DeviceLimits limits() const { return port_->limits(); }
  [[nodiscard]] std::string refusals() const { return port_->refusals(); }

  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand& command, const DeviceState& state, std::int64_t begun) noexcept override;

  [[nodiscard]] std::int64_t reports() const noexcept { return reports_; }            ///< heard so far
  [[nodiscard]] std::int64_t writes() const noexcept { return writes_; }              ///< done so far
  [[nodiscard]] std::int64_t worst_write() const noexcept { return worst_write_; }    ///< [ns]
  [[nodiscard]] std::int64_t extrapolated() const noexcept { return extrapolated_; }  ///< of the writes

 private:
  /// What the loop shows, and of what it follows.
  struct Shown {
    DeviceCommand command;
    DeviceState state;
    std::int64_t begun = 0;  // the tick [ns]
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
  std::atomic<std::int64_t> openings_ = 1;  // that a report followed
  // The loop's own.
  std::int64_t losses_told_ = 0;
  std::int64_t openings_told_ = 1;

  // From the loop to the writer.
  Latest<Shown> shown_;
  sem_t is_shown_;
  std::atomic<std::int64_t> writes_ = 0;
  std::atomic<std::int64_t> worst_write_ = 0;
  std::atomic<std::int64_t> extrapolated_ = 0;
  StaleSolution stale_;  // the writer's
  RateClamp rate_;       // too

  std::mutex wire_;                   // the writer writes, or the reader closes and opens
  bool is_open_ = true;               // under wire_
  std::atomic<bool> broken_ = false;  // the writer could not write
  std::atomic<bool> stop_ = false;
  std::thread reader_;
  std::thread writer_;
};

}  // namespace palpate
