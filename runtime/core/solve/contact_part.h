// Part of a contact problem that is solved iteratively.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/core/solve/contact_problem.h"

namespace palpate {

/// Contacts of a problem that may be closed, without its held rows. Held rows are equations, and are
/// eliminated:
///   W' = W_cc - W_ch W_hh^-1 W_hc,  b' = b_c - W_ch W_hh^-1 b_h  (Schur complement).
/// A held row with an owner is present if its owner is. All memory is allocated at construction.
class ContactPart {
 public:
  ContactPart(Index max_contacts, Index max_rows);

  /// Chooses the contacts that are closed in the guess, whole.lambda. False if there are none.
  bool choose_closed(const ContactProblem& whole) noexcept;
  void choose_all(const ContactProblem& whole) noexcept;
  /// Adds the excluded contacts that penetrate for whole.lambda by more than `force` [N] would cause. False
  /// if there are none.
  bool take_in_penetrated(const ContactProblem& whole, double force) noexcept;

  /// Computes `problem` from the whole one, without friction if requested.
  void gather(const ContactProblem& whole, bool with_friction) noexcept;
  /// Computes whole.lambda from problem.lambda; excluded contacts have no force.
  void spread(ContactProblem& whole) noexcept;

  /// Computes the change of b' [problem.rows] by a change of b; then the change of the whole lambda by
  /// `change` of the part.
  void gather_change(std::span<const double> db, std::span<double> change) noexcept;
  void spread_change(std::span<const double> change, std::span<double> dlambda) noexcept;

  ContactProblem problem;  ///< one row or d rows per contact, none held

 private:
  void eliminate_held(const ContactProblem& whole) noexcept;
  void solve_held(std::span<const double> change, std::span<double> lambda) noexcept;
  [[nodiscard]] double* factor_row(Index i) noexcept { return L_.data() + std::ptrdiff_t{i} * stride_; }
  [[nodiscard]] double* coupling_row(Index i) noexcept { return X_.data() + std::ptrdiff_t{i} * stride_; }

  std::ptrdiff_t stride_;
  std::vector<std::uint8_t> in_;  // [contacts of the whole] true for contacts in the part
  std::vector<Index> row_;        // [problem.rows] rows of the whole
  std::vector<Index> held_row_;   // [held rows] rows of the whole
  Index held_rows_ = 0;
  std::vector<double> L_;        // [held rows x stride] W_hh = L L^T
  std::vector<double> inverse_;  // [held rows] 1 / l_ii; 0 for a row that depends on earlier ones
  std::vector<double> X_;        // [held rows x stride] L^-1 W_hc
  std::vector<double> y_;        // [held rows] L^-1 b_h
};

}  // namespace palpate
