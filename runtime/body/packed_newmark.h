// Newmark's method with the packed inverse.
#pragma once

#include <span>
#include <vector>

#include "formats/model.h"
#include "runtime/body/packed_product.h"

namespace palpate {

/// Newmark's method (theory.md section 5) for all n stored dofs of a model with packed dynamics: u' =
/// K_bar^-1 f_bar by a packed product. A step is `predict`, then `advance` with the effect of the forces at
/// its end. Not for the tick: a step takes as long as the product.
class PackedNewmark {
 public:
  /// At rest. The dynamics must outlive this; `jobs` threads multiply. Throws Error if they are not packed.
  PackedNewmark(const StoredDynamics& dynamics, int jobs);

  /// Resets to rest.
  void rest() noexcept;

  /// Multiplies the motion by `share`.
  void damp(double share) noexcept;

  /// Kinetic energy 1/2 v^T M v for a velocity v [n] of the dofs [J].
  [[nodiscard]] double kinetic_energy(std::span<const double> v) noexcept;

  /// Superposes a release of the body from the static displacement u [n] by forces f [n], at velocity v [n],
  /// with the consistent acceleration M a = -f - C_d v.
  void let_go(std::span<const double> f, std::span<const double> u, std::span<const double> v) noexcept;

  /// Computes u at the end of the step for no force there: K_bar^-1 f_bar.
  void predict() noexcept;
  /// Ends the step without forces.
  void advance() noexcept;
  /// Ends the step under forces that add u [n] = K_bar^-1 E f. The `touched` dofs are driven, not free: their
  /// velocity and acceleration are backward differences. With Newmark's own, a node hit by a rigid tool would
  /// bounce off it in every other step.
  void advance(std::span<const double> u, std::span<const std::int64_t> touched) noexcept;

  [[nodiscard]] std::span<const double> u() const noexcept { return u_; }             ///< [n] present [m]
  [[nodiscard]] std::span<const double> velocity() const noexcept { return v_; }      ///< [n] present [m/s]
  [[nodiscard]] std::span<const double> acceleration() const noexcept { return a_; }  ///< [n] present [m/s^2]
  [[nodiscard]] std::span<const double> predicted() const noexcept {
    return predicted_;
  }  ///< [n] for the end of the step

 private:
  void end_step() noexcept;
  void solve_mass(std::span<double> b) noexcept;

  const StoredDynamics& dynamics_;
  PackedProduct product_;
  std::vector<double> u_, v_, a_, predicted_;
  std::vector<double> driven_;                   // velocity of the touched dofs
  std::vector<double> with_M_, with_C_, f_bar_;  // workspace
};

}  // namespace palpate
