// The small problem that a tick solves: relative motion at the contact points by the forces there.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// r = b + W lambda: relative motion r [m] of tool and surface along the rows by the forces lambda [N] on the
/// tool along them. A contact has one row, its normal, or d rows, normal and tangents; the normal row of r is
/// the gap. W = J Xi J^T + (compliance of the coupling), symmetric, positive definite. Asked for is, at each
/// contact,
/// - held: r = 0 (with a compliance on W's diagonal: a spring);
/// - else r_n >= 0, lambda_n >= 0, r_n lambda_n = 0, and with friction mu: |lambda_t| <= mu lambda_n, and
/// where that
///   is an equality lambda_t is opposed to r_t, else r_t = 0 (Coulomb; r_t is what slides in this tick).
struct ContactProblem {
  /// Room for `max_contacts` contacts with `max_rows` rows in all.
  ContactProblem(int dimension, Index max_contacts, Index max_rows);

  /// Begins anew: no contact.
  void clear() noexcept;
  /// Appends a contact. Its rows of b and lambda are zero.
  void add(double mu, bool is_held) noexcept;
  /// Appends one held row that is there for a contact: where that is left out as open, so is the row.
  void add_held_row(Index owner) noexcept;

  [[nodiscard]] Index first_row(Index contact) const noexcept { return first[contact]; }
  [[nodiscard]] Index rows_of(Index contact) const noexcept {
    return first_row(contact + 1) - first_row(contact);
  }
  [[nodiscard]] double& w(Index i, Index j) noexcept { return W[place_in_w(i, j)]; }
  [[nodiscard]] double w(Index i, Index j) const noexcept { return W[place_in_w(i, j)]; }
  /// Row i of W, `rows` long.
  [[nodiscard]] const double* row(Index i) const noexcept {
    return W.data() + static_cast<std::ptrdiff_t>(i) * stride;
  }

  int dimension;
  Index stride;
  Index contacts = 0;
  Index rows = 0;
  bool frictionless = true;        ///< no contact has friction
  std::vector<Index> first;        ///< [contacts + 1]
  std::vector<double> friction;    ///< [contacts] mu
  std::vector<std::uint8_t> held;  ///< [contacts]
  std::vector<Index> owner;        ///< [contacts] contact that a held row is there for, else -1
  std::vector<double> W;           ///< [rows x stride] [m/N]
  std::vector<double> b;           ///< [rows] [m]
  std::vector<double> lambda;      ///< [rows] [N]; before solving: a guess

 private:
  [[nodiscard]] std::size_t place_in_w(Index i, Index j) const noexcept {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(j);
  }
  void append(double mu, bool is_held, Index owner_of, Index count) noexcept;
};

}  // namespace palpate
