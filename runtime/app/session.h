// palpate-runtime session: what is in a recording.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "formats/recording.h"
#include "runtime/loop/best_effort.h"
#include "runtime/loop/histogram.h"
#include "runtime/safety/fault.h"
#include "runtime/tick/status.h"

namespace palpate {

/// A fault and when it was latched.
struct SessionFault {
  Fault fault = Fault::none;
  double time = 0.0;  ///< since the start of the run [s]
};

/// What the ticks of a session come to.
struct SessionSummary {
  std::int64_t ticks = 0;            ///< that were recorded
  std::int64_t missing = 0;          ///< between the first and the last one
  double seconds = 0.0;              ///< from the first tick to the end of the last one
  std::int64_t in_contact = 0;       ///< ticks
  double largest_force = 0.0;        ///< of the contact [N]
  double largest_force_time = 0.0;   ///< [s]
  double largest_shown = 0.0;        ///< on the hand [N]
  double largest_shown_time = 0.0;   ///< [s]
  std::int64_t deadline_misses = 0;  ///< ticks that had not ended when the next one was due
  std::int64_t worst_lateness = 0;   ///< from when a tick was due to when it began [ns]
  TimeHistogram compute;             ///< [ns]
  std::array<std::int64_t, status_names.size()>
      status_ticks{};      ///< ticks with each status bit, in the order of status_names
  BestEffort best_effort;  ///< recordings from 4.3 on know the errors
  std::vector<SessionFault> faults;
};

/// Tick k is due k / `rate` seconds after the start of the run; which k a tick is follows from its time.
SessionSummary summarise(const Recording& recording);

/// Prints what is in a recording, on the standard output; one that was killed is made one file first, with
/// its description for ParaView, over another file only by `force`. Returns the exit code; throws Error.
int session(const std::filesystem::path& recording, bool json, bool force);

}  // namespace palpate
