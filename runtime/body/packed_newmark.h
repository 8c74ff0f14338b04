// Newmark's method with the packed inverse.
#pragma once

#include <span>
#include <vector>

#include "formats/model.h"
#include "runtime/body/packed_product.h"

namespace palpate {

/// Newmark's method (theory.md section 5) for all stored dofs n of a model of packed dynamics: u' = K_bar^-1
/// f_bar by a packed product. A step is `predict`, then `advance` by what the forces that act at its end add.
/// Not for the tick: takes as long as the product.
class PackedNewmark {
 public:
  /// At rest. The dynamics must live as long; `jobs` threads multiply. Throws Error when they are not packed.
  PackedNewmark(const StoredDynamics& dynamics, int jobs);

  /// Puts it back to rest.
  void rest() noexcept;

  /// Leaves a share of the motion.
  void damp(double share) noexcept;

  /// 1/2 v^T M v of a velocity v [n] of the dofs [J].
  [[nodiscard]] double kinetic_energy(std::span<const double> v) noexcept;

  /// By superposition, from now on: the body let go in its static displacement u [n] by forces f [n], at
  /// velocity v [n]; with the consistent acceleration M a = -f - C_d v.
  void let_go(std::span<const double> f, std::span<const double> u, std::span<const double> v) noexcept;

  /// u at the end of the step if no force acts there: K_bar^-1 f_bar.
  void predict() noexcept;
  /// Ends the step without forces.
  void advance() noexcept;
  /// Ends the step under forces that add u [n] = K_bar^-1 E f. The `touched` dofs, which are driven, not
  /// free, get velocity and acceleration by backward differences: with Newmark's own, a node that a rigid
  /// tool strikes bounces off it in every other step.
  void advance(std::span<const double> u, std::span<const std::int64_t> touched) noexcept;

  [[nodiscard]] std::span<const double> u() const noexcept { return u_; }             ///< [n] now [m]
  [[nodiscard]] std::span<const double> velocity() const noexcept { return v_; }      ///< [n] now [m/s]
  [[nodiscard]] std::span<const double> acceleration() const noexcept { return a_; }  ///< [n] now [m/s^2]
  [[nodiscard]] std::span<const double> predicted() const noexcept {
    return predicted_;
  }  ///< [n] of the step

 private:
  void end_step() noexcept;
  void solve_mass(std::span<double> b) noexcept;

  const StoredDynamics& dynamics_;
  PackedProduct product_;
  std::vector<double> u_, v_, a_, predicted_;
  std::vector<double> driven_;                   // velocity of the touched dofs
  std::vector<double> with_M_, with_C_, f_bar_;  // scratch
};

}  // namespace palpate
