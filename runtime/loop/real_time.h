// Real-time rights of a loop, granted by the operating system.
#pragma once

#include <optional>
#include <string>

namespace palpate {

/// Priorities under SCHED_FIFO: above audio servers, below kernel threads.
constexpr int loop_priority = 80;
constexpr int wire_priority = 79;  ///< for the threads that read and write a device

/// Requests SCHED_FIFO for the calling thread; false, with errno, if it is refused.
bool ask_for_priority(int priority) noexcept;

/// Requests real-time scheduling of the calling thread, locked memory and, if a processor is named, that
/// processor without other threads of this process, until destroyed. None of these is required.
class RealTimeRights {
 public:
  explicit RealTimeRights(std::optional<int> processor = std::nullopt);
  ~RealTimeRights();
  RealTimeRights(const RealTimeRights&) = delete;
  RealTimeRights& operator=(const RealTimeRights&) = delete;

  /// One line on the refused rights and how to get them; empty if none was refused.
  [[nodiscard]] const std::string& refused() const noexcept { return refused_; }

 private:
  bool scheduled_ = false;
  bool locked_ = false;
  std::string refused_;
};

/// Keeps the calling thread, and those that it starts from now on, off a processor if there are others.
/// Throws Error if the machine has no such processor, or this process may not use it.
void leave_to_the_loop(int processor);

}  // namespace palpate
