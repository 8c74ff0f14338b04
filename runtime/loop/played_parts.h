// All of a run that was begun anew.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "runtime/loop/loop_report.h"
#include "runtime/loop/settings.h"

namespace palpate {

/// The sessions of a run, one after the other: each reset, change of settings and recording begins one.
class PlayedParts {
 public:
  /// What a session was.
  struct Part {
    std::string because;  ///< it began: "start", "reset", "settings", "recording begun", "recording ended"
    SettingsText settings;
    std::filesystem::path recording;  ///< empty: none
    std::int64_t dropped = 0;         ///< ticks that the recording lacks
  };

  void add(const Part& part, const LoopReport& report);

  /// All of them together; times are those of the run, without what lies between its sessions.
  [[nodiscard]] const LoopReport& report() const noexcept { return report_; }
  [[nodiscard]] std::int64_t dropped() const noexcept { return dropped_; }
  struct Row {
    Part part;
    double begun = 0.0;  ///< [s]
    std::int64_t sessions = 0;
    std::int64_t ticks = 0, ticks_in_contact = 0, misses = 0, faults = 0;
    double largest_force = 0.0, largest_shown = 0.0;  ///< [N]
  };
  /// One for each session. From 10 000 on the last one is of all further ones together.
  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }

 private:
  LoopReport report_;
  std::int64_t dropped_ = 0;
  std::vector<Row> rows_;
};

}  // namespace palpate
