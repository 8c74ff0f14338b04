// Haptic loop: read device, step, safety, display.
#pragma once

#include <atomic>
#include <cstdint>

#include "runtime/background/motion_source.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/core/tick/step.h"
#include "runtime/loop/loop_report.h"
#include "runtime/loop/monitor.h"
#include "runtime/loop/recorder.h"
#include "runtime/loop/replay_device.h"
#include "runtime/loop/tick_feed.h"
#include "runtime/safety/device.h"
#include "runtime/safety/safety.h"
#include "runtime/safety/workspace.h"

namespace palpate {

/// Requests to a running loop, from any thread.
struct LoopControl {
  /// Stops ticking and displays no force. After the pause the loop continues as if no time had passed, except
  /// that the force starts again from zero.
  std::atomic<bool> paused = false;
  std::atomic<std::int64_t> single_ticks = 0;  ///< ticks to take while paused, without force
  std::atomic<bool> acknowledged = false;      ///< a person has acknowledged the fault
  std::atomic<bool> leave = false;             ///< ends the run
};

/// Parts of a loop. The pointers may be null.
struct LoopParts {
  const Body& body;
  State& state;  ///< with one tool, and a time step that fits the loop's rate
  Device& device;
  Workspace workspace{};
  Safety* safety = nullptr;  ///< null: no person feels the force; the computed force is displayed
  PatchSource* overlays = nullptr;
  MotionSource* motion = nullptr;
  Recorder* recorder = nullptr;
  Monitor* monitor = nullptr;
  SurfaceFrames* frames = nullptr;
  LoopControl* control = nullptr;
  TickFeed* feed = nullptr;                ///< feed of a viewer
  SurfaceFrames* viewed = nullptr;         ///< pictures for the viewer
  const ReplayDevice* replayed = nullptr;  ///< the device, if overlays and motion are replayed too
};

struct LoopOptions {
  std::int64_t rate = default_rate;  ///< ticks per second
  std::int64_t ticks = 0;            ///< number of ticks to take
  bool fast = false;                 ///< do not wait: each tick begins when it is due
  std::int64_t ticks_per_view = 16;  ///< ticks between two pictures for `viewed`
};

/// Runs the loop at the rate of the options, or without waiting (`fast`, deterministic). Ends early if `stop`
/// becomes true, the control requests `leave`, or the replay fails; the device is then shown no force.
LoopReport run_loop(const LoopParts& parts, const LoopOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
