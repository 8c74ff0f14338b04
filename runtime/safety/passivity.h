// The energy that the hand is given, and the damping that takes it back.
#pragma once

#include "meshes/mesh.h"

namespace palpate {

/// Passivity observer and controller in the time domain (B. Hannaford, J.-H. Ryu, IEEE Trans. Robotics and
/// Automation 18(1), 2002), impedance causality, for the three translations. The force F(k) is held from one
/// tick to the next, so what the body and all between have absorbed from the hand is without error
///
///     E(n) = - sum_k F(k) . (x(k+1) - x(k))      [J]
///
/// A passive body has E >= 0. Where the coming tick would take it below, W = E - F . v T < 0, damping
/// alpha = - W / (T |v|^2) is added, at most `max_damping`: F - alpha v. What is left over it repays later.
/// Out of contact nothing is stored: what E is above 0 there was dissipated, and is struck.
class Passivity {
 public:
  /// `max_damping` [N s/m]: 0 only observes. `period` of the loop [s].
  Passivity(double max_damping, double period) noexcept : max_damping_(max_damping), period_(period) {}

  /// The device has come to `position` [m] under the force that was shown.
  void observe(const Vec3& position) noexcept;

  /// The force with what damping it needs.
  Vec3 control(const Vec3& force, const Vec3& velocity) noexcept;

  /// What the hand gets in the end [N], until the next one.
  void set_displayed(const Vec3& force) noexcept { shown_ = force; }

  [[nodiscard]] double energy() const noexcept { return energy_; }    ///< absorbed from the hand [J]
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
