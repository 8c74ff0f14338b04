// Contact problem of a tick: relative motion at the contact points as a function of the forces there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "base/vectors.h"

namespace palpate {

/// r = b + W lambda, or for many contacts r = b + W (lambda - guess): relative motion r [m] of tool and
/// surface along the rows for the forces lambda [N] on the tool along them. A contact has one row, its
/// normal, or d rows: normal and tangents, or for many contacts the axes x, y, z. n . r is the gap. W = J Xi
/// J^T + (compliance of the coupling), symmetric, positive definite. Conditions at each contact:
/// - held: r = 0 (with an additional compliance on the diagonal of W: a spring);
/// - otherwise r_n >= 0, lambda_n >= 0, r_n lambda_n = 0, and with friction mu: |lambda_t| <= mu lambda_n; in
///   case of equality lambda_t is opposite to r_t, otherwise r_t = 0 (Coulomb; r_t is the slip in this tick).
struct ContactProblem {
  /// Capacity of `max_contacts` contacts, with at most `few_rows` rows in all for few contacts and
  /// `many_rows` for many.
  ContactProblem(int d, Index max_contacts, Index few_rows, Index many_rows);
  ContactProblem(int d, Index max_contacts, Index max_rows) : ContactProblem(d, max_contacts, max_rows, 0) {}

  /// Removes all contacts. `are_many`: W of the next ones is in single precision.
  void clear(bool are_many = false) noexcept;
  /// Appends a contact with normal `n` in the axes of its rows. Its rows of b and lambda are zero.
  void add(double mu, bool is_held, const Vec3& n = Vec3::UnitX()) noexcept;
  /// Appends a contact without rows, which carries no force.
  void add_open() noexcept;
  /// Appends one held row that belongs to a contact: if the contact is excluded as open, so is the row.
  void add_held_row(Index owner) noexcept;

  [[nodiscard]] Index first_row(Index contact) const noexcept { return first[contact]; }
  [[nodiscard]] Index rows_of(Index contact) const noexcept {
    return first_row(contact + 1) - first_row(contact);
  }
  /// Component along a contact's normal of a vector over the rows.
  [[nodiscard]] double normal_part(Index contact, std::span<const double> of_rows) const noexcept;
  /// Gap of a contact for the present lambda, n . r, to first order [m].
  [[nodiscard]] double gap(Index contact) const noexcept;
  [[nodiscard]] double& w(Index i, Index j) noexcept { return W[place_in_w(i, j)]; }
  [[nodiscard]] double w(Index i, Index j) const noexcept { return W[place_in_w(i, j)]; }
  /// Row i of W, `rows` long.
  [[nodiscard]] const double* row(Index i) const noexcept {
    return W.data() + static_cast<std::ptrdiff_t>(i) * stride;
  }
  /// Row i of W for many contacts: compliance of body and couplings.
  [[nodiscard]] float* single_row(Index i) noexcept {
    return (coupled ? single_W : body_W).data() + static_cast<std::ptrdiff_t>(i) * single_stride;
  }
  [[nodiscard]] const float* single_row(Index i) const noexcept {
    return (coupled ? single_W : body_W).data() + static_cast<std::ptrdiff_t>(i) * single_stride;
  }
  /// Number of rows for the products of single_row, padded to whole registers.
  [[nodiscard]] std::ptrdiff_t padded_rows() const noexcept { return std::ptrdiff_t{(rows + 15) / 16} * 16; }
  /// Row i of the body's compliance alone.
  [[nodiscard]] float* body_row(Index i) noexcept {
    return body_W.data() + static_cast<std::ptrdiff_t>(i) * single_stride;
  }

  int dimension;
  Index stride;         ///< row length of W
  Index single_stride;  ///< row length of single_W
  Index contacts = 0;
  Index rows = 0;
  bool frictionless = true;        ///< no contact has friction
  bool many = false;               ///< W is in single precision, and friction's rows are along the axes
  bool moves = false;              ///< a device, the body or its overlay has moved in this tick
  bool coupled = false;            ///< many contacts: W with couplings is in single_W; otherwise it is body_W
  std::vector<Index> first;        ///< [contacts + 1]
  std::vector<double> friction;    ///< [contacts] mu
  std::vector<Vec3> normal;        ///< [contacts] in the axes of the rows
  std::vector<std::uint8_t> held;  ///< [contacts]
  std::vector<Index> owner;        ///< [contacts] contact to which a held row belongs, else -1
  std::vector<double> W;           ///< [rows x stride] [m/N]
  LargeVector<float> body_W;       ///< [rows x single_stride] many contacts: compliance of the body [m/N]
  LargeVector<float> single_W;     ///< [rows x single_stride] many contacts: the body and couplings [m/N]
  std::vector<double> b;           ///< [rows] [m]; many contacts: r for the guess
  std::vector<double> lambda;      ///< [rows] [N]; before solving: the guess
  std::vector<double> guess;       ///< [rows] lambda before solving [N]
  std::vector<double> prediction;  ///< [rows] many contacts: predicted change of lambda [N]

 private:
  [[nodiscard]] std::size_t place_in_w(Index i, Index j) const noexcept {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(j);
  }
  void append(double mu, bool is_held, Index owner_of, const Vec3& n, Index count) noexcept;
};

}  // namespace palpate
