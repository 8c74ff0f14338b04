// palpate-runtime session: summary of a recording.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "formats/recording.h"
#include "runtime/core/tick/status.h"
#include "runtime/loop/loop_report.h"
#include "runtime/safety/fault.h"

namespace palpate {

/// Fault and the time at which it was latched.
struct SessionFault {
  Fault fault = Fault::none;
  double time = 0.0;  ///< since the start of the run [s]
};

/// Summary of a session's ticks.
struct SessionSummary {
  std::int64_t ticks = 0;            ///< ticks recorded
  std::int64_t missing = 0;          ///< ticks missing between the first and the last one
  double seconds = 0.0;              ///< from the start of the first tick to the end of the last one
  std::int64_t in_contact = 0;       ///< ticks in contact
  double largest_force = 0.0;        ///< largest contact force [N]
  double largest_force_time = 0.0;   ///< time of largest_force [s]
  double largest_shown = 0.0;        ///< largest force on the hand [N]
  double largest_shown_time = 0.0;   ///< [s]
  std::int64_t deadline_misses = 0;  ///< ticks that ended after the next one was due
  std::int64_t worst_lateness = 0;   ///< largest delay of the start of a tick [ns]
  TimeHistogram compute;             ///< compute times [ns]
  std::array<std::int64_t, status_names.size()>
      status_ticks{};      ///< ticks with each status bit, in the order of status_names
  BestEffort best_effort;  ///< errors are known in recordings from version 4.3
  std::vector<SessionFault> faults;
};

/// Adds up ticks in order. Tick k is due k / `rate` seconds after the start of the run; k follows from the
/// tick's time.
class Summarising {
 public:
  explicit Summarising(std::int64_t rate) noexcept : rate_(static_cast<double>(rate)) {}

  void add(const TickRecord& tick);
  [[nodiscard]] const SessionSummary& summary() const noexcept { return summary_; }

 private:
  double rate_;
  SessionSummary summary_;
  std::int64_t first_ = 0;  // number of the first tick
  std::uint8_t fault_ = 0;  // fault of the previous tick
};

/// Prints a summary of a recording to the standard output. `finish`: first adds the index to the recording of
/// a killed run. Returns the exit code; throws Error.
int session(const std::filesystem::path& recording, bool json, bool finish);

}  // namespace palpate
