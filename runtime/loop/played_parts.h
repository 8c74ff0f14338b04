// Sessions of a run that was restarted.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "runtime/loop/loop_report.h"
#include "runtime/loop/settings.h"

namespace palpate {

/// Sessions of a run, in order: each reset, change of settings and recording begins a new one.
class PlayedParts {
 public:
  /// Description of a session.
  struct Part {
    std::string because;  ///< reason: "start", "reset", "settings", "recording begun" or "recording ended"
    SettingsText settings;
    std::filesystem::path recording;  ///< empty if there is none
    std::int64_t dropped = 0;         ///< ticks missing from the recording
  };

  void add(const Part& part, const LoopReport& report) {
    if (rows_.empty()) report_.rate = report.rate;
    if (rows_.size() < most_rows) {
      rows_.push_back(
          {.part = part, .begun = static_cast<double>(report_.ticks) / static_cast<double>(report_.rate)});
      rows_.back().part.dropped = 0;
    }
    Row& row = rows_.back();
    ++row.sessions;
    row.part.dropped += part.dropped;
    row.ticks += report.ticks;
    row.ticks_in_contact += report.ticks_in_contact;
    row.misses += report.deadline_misses;
    row.faults += std::accumulate(report.faults.begin(), report.faults.end(), std::int64_t{0});
    row.largest_force = std::max(row.largest_force, report.largest_force);
    row.largest_shown = std::max(row.largest_shown, report.largest_shown);
    dropped_ += part.dropped;
    report_.add(report);
  }

  /// Sum of all sessions; times are those of the run, without the gaps between sessions.
  [[nodiscard]] const LoopReport& report() const noexcept { return report_; }
  [[nodiscard]] std::int64_t dropped() const noexcept { return dropped_; }
  struct Row {
    Part part;
    double begun = 0.0;  ///< start [s]
    std::int64_t sessions = 0;
    std::int64_t ticks = 0, ticks_in_contact = 0, misses = 0, faults = 0;
    double largest_force = 0.0, largest_shown = 0.0;  ///< [N]
  };
  /// One row per session. From 10 000 on, the last row sums up all further ones.
  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }

 private:
  static constexpr std::size_t most_rows = 10'000;

  LoopReport report_;
  std::int64_t dropped_ = 0;
  std::vector<Row> rows_;
};

}  // namespace palpate
