// A pointer on a screen in place of a hand.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/latest.h"
#include "runtime/safety/device.h"
#include "runtime/safety/pointer_pose.h"

namespace palpate {

/// Where a viewer's pointer wants the tool, some 60 times a second; the tool follows smoothly, as the second
/// order low-pass x'' = w^2 (target - x) - 2 w x' (critically damped, w = 1 / 15 ms), so that steps of the
/// pointer are no kicks. A button and a turn take effect at once. While it is lifted the tool is where the
/// pointer is, holds nothing, and each tick is told so; let down, it follows from where it was lifted last.
/// When the viewer is gone, or silent for five seconds, while the tool is let down, the input is lost: the
/// tool is lifted, until the next word.
class MouseDevice : public Device {
 public:
  /// `start`: where the tool is until a viewer says more; `rate`: ticks a second.
  MouseDevice(const PointerPose& start, std::int64_t rate);

  /// From the viewer's thread: the target. Never waits.
  void point(const PointerPose& target) noexcept;
  /// From the viewer's thread: it is gone.
  void lose() noexcept { is_gone_ = true; }

  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  struct Word {
    PointerPose pointer;
    ToolPose landing;  // where it was lifted last
    std::int64_t number = 0;
    std::int64_t lifts = 0;  // words so far in which it was lifted
  };

  void land(const ToolPose& at) noexcept;
  void follow(const ToolPose& target) noexcept;

  Latest<Word> said_;
  Word last_word_;  // of the viewer's thread
  std::atomic<bool> is_gone_ = false;

  // Of the loop's.
  double period_;  // [s]
  DeviceState state_;
  std::int64_t heard_ = 0;     // the last word
  std::int64_t heard_at_ = 0;  // when [ns]
  std::int64_t heard_lifts_ = 0;
  bool is_lost_ = false;
};

}  // namespace palpate
