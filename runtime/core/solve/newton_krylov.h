// Solver for contact with many points.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/memory.h"
#include "runtime/core/solve/contact_law.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/reduced_contacts.h"
#include "runtime/core/solve/symmetric_product.h"

namespace palpate {

/// Solves a ContactProblem whose W is in single precision: block Gauss-Seidel sweeps, each contact solved
/// exactly with the others as they are, and between them steps of a semismooth Newton method on Alart &
/// Curnier's equations (1991) that has three unknowns at a contact that sticks, two at one that slips and one
/// without friction, and is solved by preconditioned GMRES (Saad & Schultz 1986). Sweeps make the forces
/// smooth and keep them in the cones; Newton's steps solve what sweeps are slow at. It starts from the guess
/// in lambda and the prediction of its change, or without that where it is no better, and costs next to
/// nothing where the guess is the solution. All that is long is in single precision: forces and motions
/// change little from tick to tick. docs/decisions has what it was compared with. All memory is taken at
/// construction.
///
/// Residual: the largest difference of the two sides of the equations at a contact, relative to the largest
/// force. The sum of the forces, which is felt, is accurate to a tenth of that: the remaining errors are
/// rough and cancel.
class NewtonKrylov {
 public:
  NewtonKrylov(Index max_contacts, Index max_rows);

  /// Computes problem.lambda from the guess in it. False if the residual exceeds ManyTuning's `accepted` at
  /// the end of the budget: lambda is then the best found, inside the cones.
  bool solve(ContactProblem& problem) noexcept;

  /// Makes lambda better where W is in double precision: to the resolution of single precision, as `solve`
  /// does. False when the capacity is exceeded, or the residual is over `accepted`.
  bool improve(ContactProblem& problem) noexcept;

  /// Derivative of lambda with respect to b, for up to three changes: `db` and `dlambda` [changes x rows];
  /// dlambda holds a guess before, which may be zero. Contacts stay open, sticking or slipping as they are.
  void derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                  std::span<double> dlambda) noexcept;

  [[nodiscard]] int products() const noexcept { return products_; }  ///< products with W in the last `solve`
  [[nodiscard]] int rounds() const noexcept { return rounds_; }      ///< rounds of the last `solve`
  [[nodiscard]] double residual() const noexcept {
    return residual_;
  }  ///< residual of the last `solve` [largest force]
  /// r [rows] at the end of the last `solve` [m].
  [[nodiscard]] std::span<const float> motion() const noexcept { return r_; }

 private:
  [[nodiscard]] std::span<ContactLaw> contacts() noexcept { return std::span(contacts_).first(count_); }
  [[nodiscard]] std::span<const ContactLaw> contacts() const noexcept {
    return std::span(contacts_).first(count_);
  }
  void load(const ContactProblem& problem, const SymmetricRows& W) noexcept;
  [[nodiscard]] const float* row(Index i) const noexcept { return W_.entries + W_.stride * i; }
  void enter_cones() noexcept;
  bool move_by_change() noexcept;
  void find_motion(const ContactProblem& problem) noexcept;
  void predict(std::span<const double> prediction) noexcept;
  void keep_best() noexcept;
  void take_best() noexcept;
  template <typename Real>
  [[nodiscard]] Vec3 at(const std::vector<Real>& v, const ContactLaw& contact) const noexcept;
  void change_force(const ContactLaw& contact, const Vec3& change) noexcept;
  void open(const ContactLaw& contact) noexcept;
  [[nodiscard]] bool is_present(const ContactLaw& contact) const noexcept;
  void sweep() noexcept;
  void find_residual() noexcept;
  void choose_modes() noexcept;
  void move_to_modes() noexcept;
  bool newton_step() noexcept;
  bool iterate(ContactProblem& problem, std::span<const double> prediction) noexcept;
  [[nodiscard]] double round_work(bool with_step) const noexcept;
  void count_products(int products) noexcept;

  std::vector<ContactLaw> contacts_;
  std::size_t count_ = 0;
  SymmetricRows W_{};  // of the problem, or of `improved_`
  std::vector<double> f_,
      best_f_;  // [rows] forces: the sum of single-precision changes; those of the smallest residual
  std::vector<float> r_, best_r_;  // [rows] motion
  std::vector<float> change_, product_;
  std::ptrdiff_t improved_stride_;
  LargeVector<float> improved_;  // [improved stride x the same] W of a problem in double precision
  ReducedContacts reduced_;
  int products_ = 0;
  double work_ = 0.0;  // multiplications
  int rounds_ = 0;
  double residual_ = 0.0;       // [largest force]
  double largest_force_ = 0.0;  // [N]
  double best_ = 0.0;           // residual of best_f_
};

}  // namespace palpate
