// The loop: device, step, safety, device.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "runtime/background/motion_source.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/loop/best_effort.h"
#include "runtime/loop/histogram.h"
#include "runtime/loop/monitor.h"
#include "runtime/loop/recorder.h"
#include "runtime/loop/replay_device.h"
#include "runtime/loop/tick_feed.h"
#include "runtime/safety/device.h"
#include "runtime/safety/safety.h"
#include "runtime/safety/workspace.h"
#include "runtime/tick/step.h"

namespace palpate {

inline constexpr std::int64_t default_rate = 1000;  ///< ticks a second

/// What a person may ask of a loop that runs, from any thread.
struct LoopControl {
  /// Takes no ticks, and shows the device no force: it goes on as if no time had passed, but that force
  /// begins anew.
  std::atomic<bool> paused = false;
  std::atomic<std::int64_t> single_ticks = 0;  ///< to take while paused; nothing is shown of them
  std::atomic<bool> acknowledged = false;      ///< the fault was seen
  std::atomic<bool> leave = false;             ///< ends the run
};

/// What a loop is made of. The pointers may be null.
struct LoopParts {
  const Body& body;
  State& state;  ///< with one tool, and ticks of the loop's rate
  Device& device;
  Workspace workspace{};
  Safety* safety = nullptr;  ///< null: nobody feels it, the device is shown what was computed
  PatchSource* overlays = nullptr;
  MotionSource* motion = nullptr;
  Recorder* recorder = nullptr;
  Monitor* monitor = nullptr;
  SurfaceFrames* frames = nullptr;
  LoopControl* control = nullptr;
  TickFeed* feed = nullptr;             ///< of a viewer
  SurfaceFrames* viewed = nullptr;      ///< and its pictures, of each tick that it is given
  const Recording* replayed = nullptr;  ///< session whose overlays and motion come as they came then
};

struct LoopOptions {
  std::int64_t rate = default_rate;  ///< ticks a second
  std::int64_t ticks = 0;            ///< to take
  bool fast = false;                 ///< do not wait: each tick begins when it is due
  std::int64_t ticks_per_view = 16;  ///< from one picture for `viewed` to the next
};

/// What is told of a run when it is over.
struct LoopReport {
  std::int64_t rate = default_rate;
  std::int64_t ticks = 0;
  std::int64_t ticks_in_contact = 0;
  std::int64_t ticks_begun_inside = 0;     ///< from the first on, until the tool was out of the body
  Index most_contacts = 0;                 ///< closed contact points in one tick
  std::int64_t deadline_misses = 0;        ///< ticks that were not done when the next one was due
  TimeHistogram lateness;                  ///< from when a tick was due to when it began [ns]
  TimeHistogram compute;                   ///< of the choice of the overlay and `step` [ns]
  double largest_force = 0.0;              ///< computed, on the body's side [N]
  double largest_force_time = 0.0;         ///< [s]
  double largest_jump = 0.0;               ///< of it between two ticks [N]
  double largest_jump_time = 0.0;          ///< of the second one [s]
  double largest_greens_error = 0.0;       ///< of ToolState::greens_error [N]
  double largest_greens_error_time = 0.0;  ///< [s]
  double largest_shown = 0.0;              ///< of the force that the device was shown [N]
  std::array<std::int64_t, status_names.size()>
      status_ticks{};  ///< ticks with each status bit, in the order of status_names
  BestEffort best_effort;
  std::array<std::int64_t, fault_names.size()> faults{};  ///< latched, in the order of fault_names
  std::int64_t opened_again = 0;                          ///< how often a lost device came back
  ReplayDifference replay;                                ///< where a session is replayed
  bool interrupted = false;                               ///< by `stop`
};

/// Steps at the rate of the options, or as fast as it goes without waiting (`fast`: deterministic). Ends
/// early when `stop` becomes true or the control says `leave`; the device is shown no force then.
LoopReport run_loop(const LoopParts& parts, const LoopOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
