// What the operating system can do for a loop that must not be late.
#pragma once

#include <sched.h>

#include <string>

namespace palpate {

/// Asks for real-time scheduling of the calling thread and for locked memory, until destroyed. Neither is
/// needed to run.
class RealTimeRights {
 public:
  RealTimeRights();
  ~RealTimeRights();
  RealTimeRights(const RealTimeRights&) = delete;
  RealTimeRights& operator=(const RealTimeRights&) = delete;

  /// One line on what was refused and how to get it; empty when nothing was.
  [[nodiscard]] const std::string& refused() const noexcept { return refused_; }

 private:
  bool scheduled_ = false;
  bool locked_ = false;
  std::string refused_;
};

}  // namespace palpate
