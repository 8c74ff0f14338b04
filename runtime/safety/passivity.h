// Observer of the energy given to the hand, and the damping that takes it back.
#pragma once

#include "base/vectors.h"

namespace palpate {

/// Passivity observer and controller in the time domain (B. Hannaford, J.-H. Ryu, IEEE Trans. Robotics and
/// Automation 18(1), 2002), impedance causality, for the three translations. The force F(k) is held constant
/// over a tick, so the energy absorbed from the hand is exactly
///
///     E(n) = - sum_k F(k) . (x(k+1) - x(k))      [J]
///
/// A passive body has E >= 0. If the next tick would make it negative, W = E - F . v T < 0, damping alpha = -
/// W / (T |v|^2) is added, at most `max_damping`: F - alpha v. A remaining deficit is repaid later. Without
/// contact no energy is stored: a positive E was dissipated and is reset to 0.
class Passivity {
 public:
  /// `max_damping` [N s/m]; 0 only observes. `period`: period of the loop [s].
  Passivity(double max_damping, double period) noexcept : max_damping_(max_damping), period_(period) {}

  /// Updates the energy: the device moved to `position` [m] under the displayed force.
  void observe(const Vec3& position) noexcept;

  /// Returns the force [N] with the damping needed at `velocity` [m/s].
  Vec3 control(const Vec3& force, const Vec3& velocity) noexcept;

  /// Sets the force that the hand finally gets until the next tick [N].
  void set_displayed(const Vec3& force) noexcept { shown_ = force; }

  [[nodiscard]] double energy() const noexcept { return energy_; }    ///< energy absorbed from the hand [J]
  [[nodiscard]] double damping() const noexcept { return damping_; }  ///< alpha of the last tick [N s/m]

  void reset() noexcept { *this = Passivity(max_damping_, period_); }

 private:
  double max_damping_;
  double period_;
  Vec3 shown_ = Vec3::Zero();
  Vec3 position_ = Vec3::Zero();
  double energy_ = 0.0;
  double damping_ = 0.0;
  bool placed_ = false;
};

}  // namespace palpate
