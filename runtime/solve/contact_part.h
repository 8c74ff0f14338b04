// The part of a contact problem that is solved by iteration.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solve/contact_problem.h"

namespace palpate {

/// The contacts of a contact problem that may be closed, without its held rows: these are equations, and
/// eliminated,
///   W' = W_cc - W_ch W_hh^-1 W_hc,  b' = b_c - W_ch W_hh^-1 b_h  (Schur complement).
/// A held row that has an owner is there when that is. All memory is taken at construction.
class ContactPart {
 public:
  ContactPart(Index max_contacts, Index max_rows);

  /// The contacts that the guess, whole.lambda, closes. False when there are none.
  bool choose_closed(const ContactProblem& whole) noexcept;
  void choose_all(const ContactProblem& whole) noexcept;
  /// Takes in the contacts that were left out and that whole.lambda lets penetrate by more than `force` [N]
  /// would. False when there are none.
  bool take_in_penetrated(const ContactProblem& whole, double force) noexcept;

  /// Fills `problem` from the whole one, without friction if so wished.
  void gather(const ContactProblem& whole, bool with_friction) noexcept;
  /// Fills whole.lambda from problem.lambda; contacts that are left out have none.
  void spread(ContactProblem& whole) noexcept;

  /// What b' changes by when b does: [problem.rows]. Then dlambda of the whole, where the part's is `change`.
  void gather_change(std::span<const double> db, std::span<double> change) noexcept;
  void spread_change(std::span<const double> change, std::span<double> dlambda) noexcept;

  ContactProblem problem;  ///< one row or d rows a contact, none held

 private:
  void eliminate_held(const ContactProblem& whole) noexcept;
  void solve_held(std::span<const double> change, std::span<double> lambda) noexcept;
  [[nodiscard]] double* factor_row(Index i) noexcept { return L_.data() + std::ptrdiff_t{i} * stride_; }
  [[nodiscard]] double* coupling_row(Index i) noexcept { return X_.data() + std::ptrdiff_t{i} * stride_; }

  std::ptrdiff_t stride_;
  std::vector<std::uint8_t> in_;  // [contacts of the whole]
  std::vector<Index> row_;        // [problem.rows] rows of the whole
  std::vector<Index> held_row_;   // [held rows] rows of the whole
  Index held_rows_ = 0;
  std::vector<double> L_;        // [held rows x stride] W_hh = L L^T
  std::vector<double> inverse_;  // [held rows] 1 / l_ii, 0 for a row that depends on those before
  std::vector<double> X_;        // [held rows x stride] L^-1 W_hc
  std::vector<double> y_;        // [held rows] L^-1 b_h
};

}  // namespace palpate
