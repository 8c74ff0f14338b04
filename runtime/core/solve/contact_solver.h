// The solvers of contact problems.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/core/solve/active_set.h"
#include "runtime/core/solve/cone_solver.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/newton_krylov.h"

namespace palpate {

/// Solves any ContactProblem, by the method that is quickest for its size: where W is in single precision by
/// NewtonKrylov, else without friction by the ActiveSet, with friction by the ConeSolver. All memory is taken
/// at construction.
class ContactSolver {
 public:
  /// Capacity in contacts and rows.
  struct Room {
    Index contacts = 0;
    Index rows = 0;
  };
  /// `max_frictionless`: rows of the active set.
  ContactSolver(Index max_frictionless, Room cones, Room many);

  /// True if problems of so many contacts, of which so many carried force, are for NewtonKrylov.
  [[nodiscard]] static bool are_many(Index contacts, Index closed, bool frictionless) noexcept;

  /// Fills problem.lambda from the guess in it. False where it did not reach its tolerance.
  bool solve(ContactProblem& problem) noexcept;

  /// Changes of lambda by changes of b, for up to three: `db` and `dlambda` [changes x rows]; dlambda holds a
  /// guess before, which iteration starts from. After `solve`.
  void derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                  std::span<double> dlambda) noexcept;

  /// True if the last `solve` left time for another.
  [[nodiscard]] bool was_easy() const noexcept;
  /// Change of forces by rounding alone [largest force]; 0: the method is exact.
  [[nodiscard]] double rounding() const noexcept;
  /// r [rows] that the last `solve` left at contacts that stick [m]; empty where that is next to nothing.
  [[nodiscard]] std::span<const float> left_motion() const noexcept;
  /// Error of the force, where a step of Newton's method would change it by `step`, of a problem that
  /// was not solved; `residual`: Imbalance's [N].
  [[nodiscard]] double error(double step, double residual) const noexcept;
  [[nodiscard]] int rounds() const noexcept;  ///< of the last `solve`

 private:
  enum class Method : std::uint8_t { active_set, cone_solver, newton_krylov };

  ActiveSet active_set_;
  ConeSolver cone_solver_;
  NewtonKrylov newton_krylov_;
  Method method_ = Method::active_set;  // of the last `solve`
  bool was_improved_ = false;           // by newton_krylov_
};

}  // namespace palpate
