// What a loop has counted.
#pragma once

#include <array>
#include <cstdint>

#include "runtime/loop/best_effort.h"
#include "runtime/loop/histogram.h"
#include "runtime/loop/replay_device.h"
#include "runtime/safety/fault.h"
#include "runtime/tick/status.h"

namespace palpate {

inline constexpr std::int64_t default_rate = 1000;  ///< ticks a second

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
  double largest_force_depth = 0.0;        ///< that the surface was pressed in by then [m]
  double largest_force_stiffening = 1.0;   ///< mesh_stiffening.h, then
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

  /// Takes in what came after it: times are those of one run that goes on.
  void add(const LoopReport& later);
};

}  // namespace palpate
