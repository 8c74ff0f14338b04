// Newmark's method in modal coordinates.
#pragma once

#include <span>
#include <vector>

#include "matrices/newmark.h"
#include "runtime/core/body/modes.h"

namespace palpate {

/// Newmark's method (theory.md section 5, modal form) for q_i'' + c_i q_i' + omega_i^2 q_i = phi_i^T f, c_i =
/// damping.mass + damping.stiffness omega_i^2. A step is `predict`, then `advance` with the force at its end.
/// Calls allocate nothing.
class ModalNewmark {
 public:
  /// At rest.
  ModalNewmark(std::span<const double> omega, const Rayleigh& damping, const Newmark& newmark);

  /// Superposes a release of the body from modal forces `g` = phi^T f [k] that changed by `rate` [k] per
  /// second: q = g / omega^2 with the corresponding velocity and consistent acceleration.
  void let_go(std::span<const double> g, std::span<const double> rate) noexcept;

  /// Computes q at the end of the step for no force there.
  void predict() noexcept;
  /// Ends the step under modal forces g [k]: q' = q_predicted + g / k_bar.
  void advance(std::span<const double> g) noexcept;
  /// Ends the step without forces: q' = q_predicted.
  void advance() noexcept;

  /// Multiplies the motion by `share`.
  void damp(double share) noexcept;

  [[nodiscard]] std::span<const double> q() const noexcept { return q_; }         ///< present q
  [[nodiscard]] std::span<const double> velocity() const noexcept { return v_; }  ///< present q'
  [[nodiscard]] std::span<const double> predicted() const noexcept {
    return predicted_;
  }  ///< at the step's
     ///< end
  /// [k] effective stiffness k_bar_i = omega_i^2 + a0 + a1 c_i.
  [[nodiscard]] std::span<const double> effective_stiffness() const noexcept { return k_bar_; }

 private:
  Newmark newmark_;
  std::vector<double> omega2_;     // [k]
  std::vector<double> c_;          // [k]
  std::vector<double> k_bar_;      // [k]
  std::vector<double> q_, v_, a_;  // [k]
  std::vector<double> predicted_;  // [k]
};

}  // namespace palpate
