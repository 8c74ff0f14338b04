// The loop: device, step, safety, device.
#pragma once

#include <atomic>
#include <cstdint>

#include "runtime/background/motion_source.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/loop/loop_report.h"
#include "runtime/loop/monitor.h"
#include "runtime/loop/recorder.h"
#include "runtime/loop/replay_device.h"
#include "runtime/loop/tick_feed.h"
#include "runtime/safety/device.h"
#include "runtime/safety/safety.h"
#include "runtime/safety/workspace.h"
#include "runtime/tick/step.h"

namespace palpate {

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
  TickFeed* feed = nullptr;                ///< of a viewer
  SurfaceFrames* viewed = nullptr;         ///< and its pictures, of each tick that it is given
  const ReplayDevice* replayed = nullptr;  ///< the device, where overlays and motion come as they came then
};

struct LoopOptions {
  std::int64_t rate = default_rate;  ///< ticks a second
  std::int64_t ticks = 0;            ///< to take
  bool fast = false;                 ///< do not wait: each tick begins when it is due
  std::int64_t ticks_per_view = 16;  ///< from one picture for `viewed` to the next
};

/// Steps at the rate of the options, or as fast as it goes without waiting (`fast`: deterministic). Ends
/// early when `stop` becomes true, the control says `leave` or what is replayed failed; the device is shown
/// no force then.
LoopReport run_loop(const LoopParts& parts, const LoopOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
