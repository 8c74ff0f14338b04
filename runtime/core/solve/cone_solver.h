// Solver for contact with Coulomb friction.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "runtime/core/solve/active_set.h"
#include "runtime/core/solve/contact_part.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/tick_tuning.h"

namespace palpate {

/// Solves a ContactProblem with friction: a semismooth Newton method on Alart & Curnier's equations (1991)
///   lambda_n = max(0, lambda_n - r_n / w_n),
///   lambda_t = projection of lambda_t - r_t / w_t onto the disc of radius mu lambda_n,
/// safeguarded by block Gauss-Seidel sweeps and, if these cycle, by proximal steps: a term pulls the forces
/// towards their present values, with a weight that decreases from step to step (Rockafellar 1976). Residual:
/// the largest difference of the two sides. Only contacts closed in the guess are solved for (without a
/// guess: those closed without friction); others that are penetrated afterwards are added. The budget is
/// ConeTuning's `most_rounds` rounds, and beyond the fourth `most_work`, or that of `take_time`. All memory
/// is allocated at construction.
class ConeSolver {
 public:
  ConeSolver(Index max_contacts, Index max_rows);

  /// Sets a budget of rounds, whatever they cost, for solves without a waiting tick.
  void take_time(int most_rounds) noexcept {
    most_rounds_ = most_rounds;
    most_work_ = std::numeric_limits<double>::infinity();
  }

  /// Computes problem.lambda from the guess in it, to `tolerance` if the budget suffices. False if the
  /// residual exceeds `accepted`, or an excluded contact is penetrated: lambda is then the best found, with
  /// forces inside the cones.
  bool solve(ContactProblem& problem) noexcept;

  /// Derivative of lambda [rows] for a change `db` [rows] of b. Contacts stay open, sticking or slipping as
  /// they are.
  void derivative(const ContactProblem& problem, std::span<const double> db,
                  std::span<double> dlambda) noexcept;

  [[nodiscard]] int rounds() const noexcept { return rounds_; }  ///< rounds of the last `solve`
  [[nodiscard]] bool was_easy() const noexcept {
    return work_ < tuning.cone.easy_share * tuning.cone.most_work;
  }  ///< `solve` left time for another pass

 private:
  enum class Mode : std::uint8_t { open, stick, slip };

  void find_motion(const ContactProblem& problem) noexcept;
  void change(ContactProblem& problem, Index row, double by) noexcept;
  void scale_rows(const ContactProblem& problem) noexcept;
  [[nodiscard]] double residual(const ContactProblem& problem) const noexcept;
  void sweep(ContactProblem& problem) noexcept;
  void choose_modes(const ContactProblem& problem) noexcept;
  void linearise(const ContactProblem& problem) noexcept;
  bool factor_jacobian() noexcept;
  void solve_jacobian() noexcept;
  bool newton_step(ContactProblem& problem) noexcept;
  bool iterate(ContactProblem& problem, int rounds) noexcept;
  void add_springs(ContactProblem& problem, double share) noexcept;
  void remove_springs(ContactProblem& problem) noexcept;
  [[nodiscard]] bool budget_spent() const noexcept;
  [[nodiscard]] bool is_good_enough(const ContactProblem& problem, double share) const noexcept;
  bool solve_part(ContactProblem& problem) noexcept;
  void start_from(ContactProblem& problem, const std::vector<double>& lambda) noexcept;
  bool search_along_step(ContactProblem& problem, double& now) noexcept;
  [[nodiscard]] double* jacobian_row(Index i) noexcept {
    return J_.data() + static_cast<std::ptrdiff_t>(i) * stride_;
  }

  ContactPart part_;  // contacts that may be closed; all the following belongs to this part
  ActiveSet without_friction_;
  std::ptrdiff_t stride_;
  std::vector<double> motion_;     // [rows] r
  std::vector<double> weight_;     // [rows] 1 / w_n at normal rows, 1 / w_t at tangential ones [N/m]
  std::vector<Mode> mode_;         // [contacts]
  std::vector<double> direction_;  // [rows] direction of lambda_t for a slipping contact
  std::vector<double> share_;      // [contacts] mu lambda_n / |lambda_t - r_t / w_t| for a slipping contact
  std::vector<Index> unknown_;     // [unknowns] rows of the contacts that are not open
  Index unknowns_ = 0;
  std::vector<double> J_;         // [unknowns x stride] Jacobian, then its LU factor
  std::vector<Index> pivot_;      // [unknowns]
  std::vector<double> x_;         // [unknowns]
  std::vector<double> best_;      // [rows] lambda of the smallest residual
  std::vector<double> from_;      // [rows] start of a step
  std::vector<double> newton_;    // [rows] end of a step
  std::vector<double> guess_;     // [rows]
  std::vector<double> diagonal_;  // [rows] diagonal of W
  std::vector<double> b_;         // [rows]
  double work_ = 0.0, most_work_ = tuning.cone.most_work;
  int rounds_ = 0, most_rounds_ = tuning.cone.most_rounds;
};

}  // namespace palpate
