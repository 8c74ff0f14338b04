// Start of the force: outside the body, and from zero.
#pragma once

#include <algorithm>

namespace palpate {

/// Small-force rule: the gate opens once the force has been small for a while, outside the body. (As in
/// CHAI3D, cGenericTool::setWaitForSmallForce.)
class EngageGate {
 public:
  /// `small`: largest force that counts as small [N]; `calm_time`: how long it must last [s].
  EngageGate(double small, double calm_time) noexcept : small_(small), calm_time_(calm_time) {}

  /// Returns true if force may be displayed. `force`: magnitude with an open gate [N]; `time` since the last
  /// call [s].
  bool pass(double force, bool inside_body, double time) noexcept {
    calm_ = force <= small_ && !inside_body ? calm_ + time : 0.0;
    open_ = open_ || (calm_ > 0.0 && calm_ >= calm_time_);
    return open_;
  }

  [[nodiscard]] bool open() const noexcept { return open_; }

  void close() noexcept {
    open_ = false;
    calm_ = 0.0;
  }

 private:
  double small_;
  double calm_time_;
  double calm_ = 0.0;
  bool open_ = false;
};

/// Factor that grows from 0 to 1 at a constant rate.
class Ramp {
 public:
  /// `duration` [s]; 0: the factor is 1 at once.
  explicit Ramp(double duration) noexcept : duration_(duration) {}

  /// Advances by `time` [s] and returns the factor.
  double advance(double time) noexcept {
    share_ = duration_ > 0.0 ? std::min(1.0, share_ + time / duration_) : 1.0;
    return share_;
  }

  [[nodiscard]] double share() const noexcept { return share_; }
  void restart() noexcept { share_ = 0.0; }

 private:
  double duration_;
  double share_ = 0.0;
};

}  // namespace palpate
