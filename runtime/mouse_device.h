// A pointer on a screen in place of a hand.
#pragma once

#include <atomic>
#include <cstdint>

#include "runtime/devices/device.h"
#include "runtime/latest.h"

namespace palpate {

/// Where a viewer's pointer wants the tool, some 60 times a second; the tool follows smoothly, as the second
/// order low-pass x'' = w^2 (target - x) - 2 w x' (critically damped, w = 1 / 15 ms), so that steps of the
/// pointer are no kicks. A button and a turn take effect at once. When the viewer is gone, or silent for a
/// second while its button is down, the input is lost, and comes back with the next word.
class MouseDevice : public Device {
 public:
  /// `start`: where the tool is until a viewer says more; `rate`: ticks a second.
  MouseDevice(const ToolPose& start, std::int64_t rate);

  /// From the viewer's thread: the target. Never waits.
  void point(const ToolPose& target) noexcept;
  /// From the viewer's thread: it is gone.
  void lose() noexcept { is_gone_ = true; }

  DeviceNews hear(const TickTime& tick) noexcept override;
  void show(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  struct Word {
    ToolPose pose;
    std::int64_t number = 0;
  };

  Latest<Word> said_;
  std::int64_t words_ = 0;  // of the viewer's thread
  std::atomic<bool> is_gone_ = false;

  // Of the loop's.
  double period_;  // [s]
  DeviceState state_;
  std::int64_t heard_ = 0;     // the last word
  std::int64_t heard_at_ = 0;  // when [ns]
  bool is_lost_ = false;
};

}  // namespace palpate
