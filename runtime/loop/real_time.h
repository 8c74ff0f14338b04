// What the operating system can do for a loop that must not be late.
#pragma once

#include <optional>
#include <string>

namespace palpate {

/// Priorities under SCHED_FIFO: above audio servers, below the kernel's own threads.
constexpr int loop_priority = 80;
constexpr int wire_priority = 79;  ///< of the threads that read and write a device

/// Asks for SCHED_FIFO for the calling thread; false, with errno, when it is refused.
bool ask_for_priority(int priority) noexcept;

/// Asks for real-time scheduling of the calling thread, for locked memory and, if one is named, for a
/// processor to run on alone with nobody else of this process, until destroyed. None is needed to run.
class RealTimeRights {
 public:
  explicit RealTimeRights(std::optional<int> processor = std::nullopt);
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

/// Keeps the calling thread, and those that it starts from now on, off a processor, where there are others.
/// Throws Error when the machine has no such processor, or this process may not use it.
void leave_to_the_loop(int processor);

}  // namespace palpate
