// What a person is told while the loop runs, and may say to it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>

#include "base/ring.h"
#include "runtime/loop/histogram.h"
#include "runtime/safety/device.h"
#include "runtime/safety/fault.h"
#include "runtime/tick/status.h"

namespace palpate {

/// What is told of a tick.
struct TickNote {
  std::int64_t number = 0;
  std::int64_t lateness_ns = 0;  ///< from when it was due to when it began
  std::int64_t compute_ns = 0;
  Vec3 force = Vec3::Zero();  ///< computed, on the body [N]
  double shown = 0.0;         ///< that the device was told [N]
  double depth = 0.0;         ///< how far the contacts press the surface in, at most [m]
  std::int32_t contacts = 0;
  bool rigid = false;  ///< the tool presses on what cannot move
  StepStatus status = StepStatus::ok;
  double force_error = 0.0;   ///< how far `force` may be off, where it is a best effort [N]
  std::int32_t left_out = 0;  ///< contact points that found no room
  SafetyPhase phase = SafetyPhase::active;
  Fault fault = Fault::none;
  DeviceEvent events = DeviceEvent::none;
};

/// What a person can do about a fault: a sentence without its end.
[[nodiscard]] std::string_view fault_remedy(Fault fault);

struct MonitorOptions {
  std::int64_t rate = 1000;   ///< ticks a second
  bool line = false;          ///< a line on the error stream that is renewed twice a second
  bool acknowledges = false;  ///< a line on the standard input acknowledges a fault, and so does SIGUSR1
  bool shows_safety = false;  ///< the phase and what the hand is shown
};

/// A line on the last half second: time, force, contacts, lateness and compute time (median, 99.9 %, worst)
/// and how they are spread from 1 us to 1 ms; and a line for each fault and each device that went or came.
/// From a thread of its own, which takes SIGUSR1 where all threads block it (block_acknowledging_signal).
class Monitor {
 public:
  explicit Monitor(const MonitorOptions& options);
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// By the loop after each tick; never waits.
  void push(TickNote note) noexcept { notes_.push(note); }

  /// Whether a person has acknowledged the fault since the last call. By the loop; never waits.
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

  // The thread's own.
  TimeHistogram lateness_;  // since the last line
  TimeHistogram compute_;
  TickNote last_;
  std::int64_t misses_ = 0;
  bool asks_ = true;
  bool drawn_ = false;
  std::thread thread_;
};

/// For the calling thread and those that it starts.
void block_acknowledging_signal();

/// Eight-level bars of how durations are spread over twelve classes, each twice as long as the one before:
/// below 1 us, 1 to 2 us, ..., from 1 ms on. The scale is logarithmic, one sample shows.
[[nodiscard]] std::string histogram_bars(const TimeHistogram& histogram);

}  // namespace palpate
