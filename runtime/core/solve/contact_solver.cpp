#include "runtime/core/solve/contact_solver.h"

#include <cmath>

#include "runtime/core/solve/tick_tuning.h"

namespace palpate {

ContactSolver::ContactSolver(Index max_frictionless, Room cones, Room many)
    : active_set_(max_frictionless),
      cone_solver_(cones.contacts, cones.rows),
      newton_krylov_(many.contacts, many.rows) {}

bool ContactSolver::are_many(Index contacts, Index closed, bool frictionless) noexcept {
  if (frictionless) return contacts > tuning.many.few_frictionless;
  return contacts > tuning.many.few_contacts || closed > tuning.many.few_closed;
}

bool ContactSolver::solve(ContactProblem& problem) noexcept {
  method_ = problem.single         ? Method::newton_krylov
            : problem.frictionless ? Method::active_set
                                   : Method::cone_solver;
  was_improved_ = false;
  if (method_ == Method::newton_krylov) return newton_krylov_.solve(problem);
  if (method_ == Method::active_set) return active_set_.solve(problem);
  if (cone_solver_.solve(problem)) return true;
  // On a nearly singular W Newton steps cycle where sweeps converge. From there Newton steps can finish.
  was_improved_ = true;
  newton_krylov_.improve(problem);
  return cone_solver_.solve(problem);
}

void ContactSolver::derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                               std::span<double> dlambda) noexcept {
  if (method_ == Method::newton_krylov) return newton_krylov_.derivative(problem, changes, db, dlambda);
  if (method_ == Method::active_set) return active_set_.derivative(problem, changes, db, dlambda);
  const auto rows = static_cast<std::size_t>(problem.rows);
  for (std::size_t s = 0; s < static_cast<std::size_t>(changes); ++s)
    cone_solver_.derivative(problem, db.subspan(s * rows), dlambda.subspan(s * rows));
}

bool ContactSolver::was_easy() const noexcept {
  return method_ == Method::active_set ||
         (method_ == Method::cone_solver && cone_solver_.was_easy() && !was_improved_);
}

double ContactSolver::rounding() const noexcept {
  if (method_ == Method::newton_krylov) return tuning.many.no_change;
  return method_ == Method::active_set ? 0.0 : tuning.cone.no_change;
}

std::span<const float> ContactSolver::left_motion() const noexcept {
  return method_ == Method::newton_krylov ? newton_krylov_.motion() : std::span<const float>();
}

/// The solver of few contacts is cut short where steps of Newton's method run in circles: there they are much
/// too long, the residual says much too little, and the truth lies between (docs/decisions).
double ContactSolver::error(double step, double residual) const noexcept {
  return method_ == Method::newton_krylov ? tuning.hand.error_margin * step : std::sqrt(step * residual);
}

int ContactSolver::rounds() const noexcept {
  if (method_ == Method::newton_krylov) return newton_krylov_.rounds();
  return method_ == Method::active_set ? active_set_.rounds() : cone_solver_.rounds();
}

}  // namespace palpate
