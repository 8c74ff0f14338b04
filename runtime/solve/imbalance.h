// What forces that do not solve a contact problem lack.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solve/contact_problem.h"

namespace palpate {

/// Where a solver was cut short: a step of Newton's method on Alart & Curnier's equations (1991) from its
/// forces, in two parts. The forces change at once by `change`: those of contacts that are to open go, those
/// that slip go to the cone's edge, and one that penetrates without force takes what closes it alone. What
/// the contacts that are closed have to undo then is `motion`. With y, the change of the forces by a motion
/// of the tool along an axis (a solver's `derivative`), the sum of the forces along that axis lacks
///   sum of `change` along it + y . motion,
/// as W is symmetric. All memory is taken at construction.
class Imbalance {
 public:
  Imbalance(Index max_contacts, Index max_rows);

  /// Takes problem.lambda as a solver left it; two products with W.
  void find(const ContactProblem& problem) noexcept;

  [[nodiscard]] std::span<const double> change() const noexcept { return change_; }  ///< [rows] [N]
  [[nodiscard]] std::span<const double> motion() const noexcept { return motion_; }  ///< [rows] [m]
  /// Root of the sum over the contacts of the squared difference of the equations' two sides [N].
  [[nodiscard]] double residual() const noexcept { return residual_; }

 private:
  enum class Mode : std::uint8_t { open, stick, slip };

  void find_motion(const ContactProblem& problem) noexcept;
  void choose_mode(const ContactProblem& problem, Index contact) noexcept;
  void keep_equations(const ContactProblem& problem, Index contact) noexcept;

  std::vector<double> change_;  // [max rows]
  std::vector<double> motion_;  // [max rows]
  std::vector<double> step_;    // [max rows] forces that W is multiplied by
  std::vector<Mode> mode_;      // [max contacts]
  std::vector<Vec3> edge_;      // [max contacts] slipping: the cone's edge
  double residual_ = 0.0;
};

}  // namespace palpate
