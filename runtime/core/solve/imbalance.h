// Error estimate for forces that do not solve a contact problem.
#pragma once

#include <span>
#include <vector>

#include "runtime/core/solve/contact_law.h"
#include "runtime/core/solve/contact_problem.h"

namespace palpate {

/// Newton step on Alart & Curnier's equations (1991) from the forces of a solver that was stopped early, in
/// two parts. The forces change at once by `change`: those of opening contacts vanish, those of slipping ones
/// go to the edge of the cone, and a penetrating contact without force gets the force that closes it alone.
/// The closed contacts then have to correct `motion`. With y, the change of the forces by a motion of the
/// tool along an axis (a solver's `derivative`), the error of the sum of the forces along that axis is
///   sum of `change` along it + y . motion,
/// because W is symmetric. All memory is allocated at construction.
class Imbalance {
 public:
  Imbalance(Index max_contacts, Index max_rows);

  /// Evaluates problem.lambda as a solver left it, with two products with W.
  void find(const ContactProblem& problem) noexcept;

  [[nodiscard]] std::span<const double> change() const noexcept { return change_; }  ///< [rows] [N]
  [[nodiscard]] std::span<const double> motion() const noexcept { return motion_; }  ///< [rows] [m]
  /// Root of the sum over the contacts of the squared difference of the equations' two sides [N].
  [[nodiscard]] double residual() const noexcept { return residual_; }

 private:
  void find_motion(const ContactProblem& problem) noexcept;
  void choose_mode(const ContactProblem& problem, ContactLaw& contact) noexcept;
  void keep_equations(const ContactLaw& contact) noexcept;

  std::vector<double> change_;        // [max rows]
  std::vector<double> motion_;        // [max rows]
  std::vector<double> step_;          // [max rows] forces to be multiplied by W
  std::vector<ContactLaw> contacts_;  // [max contacts]
  double residual_ = 0.0;
};

}  // namespace palpate
