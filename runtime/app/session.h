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

/// Sums ticks up, one after the other. Tick k is due k / `rate` seconds after the start of the run; which k a
/// tick is follows from its time.
class Summarising {
 public:
  explicit Summarising(std::int64_t rate) noexcept : rate_(static_cast<double>(rate)) {}

  void add(const TickRecord& tick);
  [[nodiscard]] const SessionSummary& summary() const noexcept { return summary_; }

 private:
  double rate_;
  SessionSummary summary_;
  std::int64_t first_ = 0;  // number of the first tick
  std::uint8_t fault_ = 0;  // of the tick before
};

/// Prints what is in a recording, on the standard output. `finish`: one that was killed gets its index first.
/// Returns the exit code; throws Error.
int session(const std::filesystem::path& recording, bool json, bool finish);

}  // namespace palpate
