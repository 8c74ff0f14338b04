// Report to a person while the loop runs, and input from that person.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>

#include "base/ring.h"
#include "runtime/core/tick/status.h"
#include "runtime/loop/histogram.h"
#include "runtime/safety/device.h"
#include "runtime/safety/fault.h"

namespace palpate {

/// Summary of a tick for reports.
struct TickNote {
  std::int64_t number = 0;
  std::int64_t lateness_ns = 0;  ///< delay of its start
  std::int64_t compute_ns = 0;
  Vec3 force = Vec3::Zero();  ///< computed, on the body [N]
  double shown = 0.0;         ///< force displayed by the device [N]
  double depth = 0.0;         ///< largest depth to which the contacts press the surface in [m]
  std::int32_t contacts = 0;
  bool rigid = false;  ///< the tool presses on a rigid part
  StepStatus status = StepStatus::ok;
  double force_error = 0.0;   ///< possible error of `force` if it is a best effort [N]
  std::int32_t left_out = 0;  ///< contact points beyond the capacity
  double small_strain = 0.0;  ///< TickRecord::small_strain
  SafetyPhase phase = SafetyPhase::active;
  Fault fault = Fault::none;
  DeviceEvent events = DeviceEvent::none;
};

/// Returns a person's remedy for a fault: a sentence without its full stop.
[[nodiscard]] std::string_view fault_remedy(Fault fault);

struct MonitorOptions {
  std::int64_t rate = 1000;   ///< ticks per second
  bool line = false;          ///< a line on the error stream, renewed twice a second
  bool acknowledges = false;  ///< a line on the standard input acknowledges a fault, and so does SIGUSR1
  bool shows_safety = false;  ///< show the phase and the force on the hand
};

/// Prints a line on the last half second: time, force, contacts, lateness and compute time (median, 99.9 %,
/// worst) with their distribution from 1 us to 1 ms; and a line for each fault and each device that was lost
/// or came back. Runs in a thread of its own, which takes SIGUSR1 if all threads block it
/// (block_acknowledging_signal).
class Monitor {
 public:
  explicit Monitor(const MonitorOptions& options);
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Passes a tick from the loop; never waits.
  void push(TickNote note) noexcept { notes_.push(note); }

  /// Returns true if a person has acknowledged the fault since the last call. For the loop; never waits.
  [[nodiscard]] bool acknowledged() noexcept { return acknowledged_.exchange(false); }

 private:
  void run();
  void take(const TickNote& note);
  void ask();
  void say(const std::string& text);
  void draw();

  MonitorOptions options_;
  Ring<TickNote> notes_;
  std::atomic<bool> acknowledged_ = false;
  std::atomic<bool> stop_ = false;

  // Used by the thread alone.
  TimeHistogram lateness_;  // since the last line
  TimeHistogram compute_;
  TickNote last_;
  std::int64_t misses_ = 0;
  bool asks_ = true;
  bool drawn_ = false;
  std::thread thread_;
};

/// Blocks SIGUSR1 for the calling thread and those that it starts.
void block_acknowledging_signal();

/// Returns bars of eight levels for the distribution of durations over twelve classes, each twice as long as
/// the one before: below 1 us, 1 to 2 us, ..., from 1 ms. The scale is logarithmic; a single sample is
/// visible.
[[nodiscard]] std::string histogram_bars(const TimeHistogram& histogram);

}  // namespace palpate
