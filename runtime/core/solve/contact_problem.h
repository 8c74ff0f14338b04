// Contact problem of a tick: relative motion at the contact points as a function of the forces there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "base/vectors.h"

namespace palpate {

/// A square matrix by rows.
template <typename Real>
struct MatrixRows {
  Real* entries;
  std::ptrdiff_t stride;

  [[nodiscard]] Real* operator[](Index i) const noexcept { return entries + stride * i; }
};

/// r = b + W (lambda - base): relative motion r [m] of tool and surface along the rows by the forces lambda
/// [N] on the tool along them. A contact has one row, its normal, or d rows: normal and tangents, or the axes
/// x, y, z. n . r is the gap. W = J Xi J^T + (compliance of the coupling), symmetric, positive definite: in
/// double precision for solvers that factor it, with base = 0; in single precision for those that multiply
/// with it, which is fit for changes alone, so that base is the guess. Asked for is, at each contact,
/// - held: r = 0 (with a compliance on W's diagonal: a spring);
/// - else r_n >= 0, lambda_n >= 0, r_n lambda_n = 0, and with friction mu: |lambda_t| <= mu lambda_n, and
/// where that
///   is an equality lambda_t is opposed to r_t, else r_t = 0 (Coulomb; r_t is what slides in this tick).
struct ContactProblem {
  /// Capacity for `max_contacts` contacts with `max_rows` rows in all, and `max_single_rows` where W is in
  /// single precision.
  ContactProblem(int d, Index max_contacts, Index max_rows, Index max_single_rows);
  ContactProblem(int d, Index max_contacts, Index max_rows) : ContactProblem(d, max_contacts, max_rows, 0) {}

  /// Begins anew: no contact. `is_single`: W of those that come is in single precision.
  void clear(bool is_single = false) noexcept;
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
  /// Returns visit(W), with W's rows as MatrixRows of the precision that it has.
  template <class Visit>
  decltype(auto) with_w(Visit&& visit) noexcept {
    return single ? visit(MatrixRows<float>{single_W.data(), single_stride})
                  : visit(MatrixRows<double>{W.data(), stride});
  }
  template <class Visit>
  decltype(auto) with_w(Visit&& visit) const noexcept {
    return single ? visit(MatrixRows<const float>{single_W.data(), single_stride})
                  : visit(MatrixRows<const double>{W.data(), stride});
  }
  [[nodiscard]] double& w(Index i, Index j) noexcept { return W[place_in_w(i, j)]; }
  [[nodiscard]] double w(Index i, Index j) const noexcept { return W[place_in_w(i, j)]; }
  /// Row i of W, `rows` long.
  [[nodiscard]] const double* row(Index i) const noexcept {
    return W.data() + static_cast<std::ptrdiff_t>(i) * stride;
  }
  /// Row i of W in single precision, `padded_rows` long.
  [[nodiscard]] float* single_row(Index i) noexcept {
    return single_W.data() + std::ptrdiff_t{single_stride} * i;
  }
  [[nodiscard]] const float* single_row(Index i) const noexcept {
    return single_W.data() + std::ptrdiff_t{single_stride} * i;
  }
  /// Rows as far as products with W in single precision go: whole registers.
  [[nodiscard]] std::ptrdiff_t padded_rows() const noexcept { return std::ptrdiff_t{(rows + 15) / 16} * 16; }

  int dimension;
  Index stride;         ///< row length of W
  Index single_stride;  ///< row length of single_W
  Index contacts = 0;
  Index rows = 0;
  bool frictionless = true;        ///< no contact has friction
  bool single = false;             ///< W is single_W
  double precision = 1.0;          ///< factor on the residuals that are accepted with friction
  bool moves = false;              ///< a device, the body or its overlay has moved in this tick
  std::vector<Index> first;        ///< [contacts + 1]
  std::vector<double> friction;    ///< [contacts] mu
  std::vector<Vec3> normal;        ///< [contacts] in the axes of the rows
  std::vector<std::uint8_t> held;  ///< [contacts]
  std::vector<Index> owner;        ///< [contacts] contact to which a held row belongs, else -1
  std::vector<double> W;           ///< [rows x stride] [m/N]
  LargeVector<float> single_W;     ///< [rows x single_stride] zero from `rows` to `padded_rows` [m/N]
  std::vector<double> b;           ///< [rows] r by `base` [m]
  std::vector<double> base;        ///< [rows] [N]
  std::vector<double> lambda;      ///< [rows] [N]; before solving: the guess
  std::vector<double> guess;       ///< [rows] lambda before solving [N]
  std::vector<double> prediction;  ///< [rows] expected change of lambda [N]

 private:
  [[nodiscard]] std::size_t place_in_w(Index i, Index j) const noexcept {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(j);
  }
  void append(double mu, bool is_held, Index owner_of, const Vec3& n, Index count) noexcept;
};

}  // namespace palpate
