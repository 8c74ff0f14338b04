// What a person sees while waiting.
#pragma once

#include <chrono>
#include <string>

namespace palpate {

/// Progress on standard error: a line that is rewritten on a terminal, a line every few seconds elsewhere.
class Progress {
 public:
  Progress();

  /// A finished step or a remark, on a line of its own, with the seconds since the start.
  void line(const std::string& text);

  /// Share (0..1) of a long step that is done; time left is extrapolated from this step's start.
  void step(const std::string& name, double share);

  [[nodiscard]] double seconds() const;  ///< since construction

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_, step_start_;
  std::string step_name_;
  int last_percent_ = -1;
  double next_line_ = 0.0;
  bool terminal_;
  bool open_line_ = false;
};

}  // namespace palpate
