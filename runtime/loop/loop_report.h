// Statistics of a loop.
#pragma once

#include <array>
#include <cstdint>

#include "runtime/core/tick/status.h"
#include "runtime/loop/best_effort.h"
#include "runtime/loop/histogram.h"
#include "runtime/loop/replay_device.h"
#include "runtime/safety/fault.h"

namespace palpate {

inline constexpr std::int64_t default_rate = 1000;  ///< ticks per second

/// Keeps the larger of two values, and when it was.
inline void note_largest(double value, double time, double& largest, double& largest_time) noexcept {
  if (!(value > largest)) return;
  largest = value;
  largest_time = time;
}

/// Report of a run at its end.
struct LoopReport {
  std::int64_t rate = default_rate;
  std::int64_t ticks = 0;
  std::int64_t ticks_in_contact = 0;
  std::int64_t ticks_begun_inside = 0;     ///< initial ticks until the tool was out of the body
  Index most_contacts = 0;                 ///< most closed contact points in one tick
  std::int64_t deadline_misses = 0;        ///< ticks that ended after the next one was due
  TimeHistogram lateness;                  ///< delay of the start of a tick [ns]
  TimeHistogram compute;                   ///< duration of the overlay's choice and `step` [ns]
  double largest_force = 0.0;              ///< largest computed force, on the body's side [N]
  double largest_force_time = 0.0;         ///< time of largest_force [s]
  double largest_force_depth = 0.0;        ///< depth to which the surface was pressed in then [m]
  double largest_force_stiffening = 1.0;   ///< mesh_stiffening.h, at that time
  double largest_jump = 0.0;               ///< largest change of the force between two ticks [N]
  double largest_jump_time = 0.0;          ///< time of the second of these ticks [s]
  double largest_greens_error = 0.0;       ///< largest ToolState::greens_error [N]
  double largest_greens_error_time = 0.0;  ///< time of largest_force [s]
  double largest_shown = 0.0;              ///< largest force displayed by the device [N]
  std::array<std::int64_t, status_names.size()>
      status_ticks{};  ///< ticks with each status bit, in the order of status_names
  BestEffort best_effort;
  std::array<std::int64_t, fault_names.size()> faults{};  ///< latched, in the order of fault_names
  std::int64_t opened_again = 0;                          ///< number of times a lost device came back
  ReplayDifference replay;                                ///< if a session is replayed
  bool interrupted = false;                               ///< stopped early by `stop`

  /// Adds a later report; times become those of one continuous run.
  void add(const LoopReport& later);
};

}  // namespace palpate
