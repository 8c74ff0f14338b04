// Newmark's method in modal coordinates.
#pragma once

#include <span>
#include <vector>

#include "formats/newmark.h"
#include "runtime/body/modes.h"

namespace palpate {

/// Newmark's method (theory.md section 5, modal form) for q_i'' + c_i q_i' + omega_i^2 q_i = phi_i^T f,
/// c_i = damping.mass + damping.stiffness omega_i^2. A step is `predict`, then `advance` by the force that
/// acts at its end. Calls allocate nothing.
class ModalNewmark {
 public:
  /// At rest.
  ModalNewmark(std::span<const double> omega, const Rayleigh& damping, const Newmark& newmark);

  /// By superposition, from now on: the body let go under modal forces `g` = phi^T f [k] that changed by
  /// `rate` [k] a second: q = g / omega^2 and so on, with the consistent acceleration.
  void let_go(std::span<const double> g, std::span<const double> rate) noexcept;

  /// q at the end of the step if no force acts there.
  void predict() noexcept;
  /// Ends the step under modal forces g [k]: q' = q_predicted + g / k_bar.
  void advance(std::span<const double> g) noexcept;
  /// Ends the step without forces: q' = q_predicted.
  void advance() noexcept;

  /// Leaves a share of the motion.
  void damp(double share) noexcept;

  [[nodiscard]] std::span<const double> q() const noexcept { return q_; }                  ///< now
  [[nodiscard]] std::span<const double> velocity() const noexcept { return v_; }           ///< now
  [[nodiscard]] std::span<const double> predicted() const noexcept { return predicted_; }  ///< of the step
  /// [k] k_bar_i = omega_i^2 + a0 + a1 c_i
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
