// The 1 kHz loop.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "runtime/histogram.h"
#include "runtime/motion_source.h"
#include "runtime/patch_source.h"
#include "runtime/recorder.h"
#include "runtime/script_device.h"
#include "runtime/step.h"
#include "runtime/surface_frames.h"

namespace palpate {

inline constexpr std::int64_t ticks_per_second = 1000;

/// What is told of a run when it is over.
struct LoopReport {
  std::int64_t ticks = 0;
  std::int64_t ticks_in_contact = 0;
  std::int64_t ticks_begun_inside = 0;  ///< from the first on, until the tool was out of the body
  Index most_contacts = 0;              ///< closed contact points in one tick
  std::int64_t deadline_misses = 0;     ///< ticks that were not done when the next one was due
  std::int64_t worst_lateness = 0;      ///< from when a tick was due to when it began [ns]
  TimeHistogram compute;                ///< of the choice of the overlay and `step` [ns]
  double largest_force = 0.0;           ///< [N]
  double largest_force_time = 0.0;      ///< [s]
  double largest_jump = 0.0;            ///< of the force between two ticks [N]
  double largest_jump_time = 0.0;       ///< of the second one [s]
  std::array<std::int64_t, status_names.size()>
      status_ticks{};        ///< ticks with each status bit, in the order of status_names
  bool interrupted = false;  ///< by `stop`
};

/// Number of ticks from 0 to the script's last row.
std::int64_t count_ticks(const ScriptDevice& device);

/// Steps through the script at 1 kHz, or as fast as it goes without waiting (`fast`: deterministic).
/// `state` has one tool. `overlays`, `motion`, `recorder` and `frames` may be null. Ends early when `stop`
/// becomes true.
LoopReport run_loop(const Body& body, State& state, const ScriptDevice& device, PatchSource* overlays,
                    MotionSource* motion, Recorder* recorder, bool fast, const std::atomic<bool>& stop,
                    SurfaceFrames* frames = nullptr);

}  // namespace palpate
