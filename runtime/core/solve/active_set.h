// Exact solver for frictionless contact.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/core/solve/capacitance.h"
#include "runtime/core/solve/contact_problem.h"

namespace palpate {

/// Solves a ContactProblem without friction exactly, by the active set method of Lawson & Hanson (1974,
/// chapter 23) on the Cholesky factor of W, which grows and shrinks with the set. It starts from the rows
/// that carry force in the guess. Each round lowers the energy lambda^T W lambda / 2 + b^T lambda, so it
/// terminates. All memory is allocated at construction.
class ActiveSet {
 public:
  explicit ActiveSet(Index max_rows);

  /// Computes problem.lambda. False if the fixed number of rounds did not suffice: lambda is then feasible
  /// (no negative normal force), but a gap may be negative.
  bool solve(ContactProblem& problem) noexcept;

  /// Derivative of lambda with respect to b while closed contacts stay closed, for up to three changes: `db`
  /// and `dlambda` [changes x rows].
  void derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                  std::span<double> dlambda) noexcept;

  [[nodiscard]] int rounds() const noexcept { return rounds_; }  ///< rounds of the last `solve`

 private:
  enum class Row : std::uint8_t { inactive, active, dependent };

  void begin(ContactProblem& problem) noexcept;
  [[nodiscard]] bool activate_all(const ContactProblem& problem, Index count) noexcept;
  bool activate(const ContactProblem& problem, Index row) noexcept;
  void deactivate(Index position) noexcept;
  void solve_active(std::span<const double> b) noexcept;
  bool step_towards_solution(ContactProblem& problem) noexcept;
  [[nodiscard]] Index most_violated(const ContactProblem& problem) const noexcept;

  CapacitanceMatrix factor_;
  std::vector<Index> active_;         // [factor_.nodes()] active rows, in the order of the factor
  std::vector<Row> state_;            // [rows]
  std::vector<std::uint8_t> signed_;  // [rows] true for held contacts: their force may have any sign
  std::vector<double> z_;             // [3 x active] solution with all gaps of the active rows closed
  std::vector<double> entries_;       // [active + 1] row of W in the active rows
  std::vector<double> lower_;         // W of the initially active rows, packed
  int rounds_ = 0;
};

}  // namespace palpate
