// Pointer on a screen in place of a haptic device.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/latest.h"
#include "runtime/safety/device.h"
#include "runtime/safety/pointer_pose.h"

namespace palpate {

/// Tool moved by a viewer's pointer, which sends about 60 poses per second. While pressed, the tool follows
/// through a second-order low-pass x'' = w^2 (target - x) - 2 w x' (critically damped, w = 1 / 15 ms), so
/// that steps of the pointer cause no kicks; buttons and rotations act at once. While lifted, the tool is at
/// the pointer, holds nothing, and each tick gets the event; when pressed, it follows from where it was
/// lifted last. If the viewer is gone, or silent for five seconds, while pressed, the input is lost: the tool
/// is lifted until the next message.
class MouseDevice : public Device {
 public:
  /// `start`: pose of the tool until the viewer's first message; `rate`: ticks per second.
  MouseDevice(const PointerPose& start, std::int64_t rate);

  /// Sets the target, for the viewer's thread. Never waits.
  void point(const PointerPose& target) noexcept;
  /// Marks the viewer as gone, for the viewer's thread.
  void lose() noexcept { is_gone_ = true; }

  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  struct Word {
    PointerPose pointer;
    ToolPose landing;  // pose where it was lifted last
    std::int64_t number = 0;
    std::int64_t lifts = 0;  // messages so far that lifted it
  };

  void land(const ToolPose& at) noexcept;
  void follow(const ToolPose& target) noexcept;

  Latest<Word> said_;
  Word last_word_;  // used by the viewer's thread
  std::atomic<bool> is_gone_ = false;

  // Used by the loop.
  double period_;  // [s]
  DeviceState state_;
  std::int64_t heard_ = 0;     // number of the last message
  std::int64_t heard_at_ = 0;  // time of arrival [ns]
  std::int64_t heard_lifts_ = 0;
  bool is_lost_ = false;
};

}  // namespace palpate
