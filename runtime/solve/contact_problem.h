// The small problem that a tick solves: relative motion at the contact points by the forces there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "meshes/mesh.h"

namespace palpate {

/// r = b + W lambda, or of many contacts r = b + W (lambda - guess): relative motion r [m] of tool and
/// surface along the rows by the forces lambda [N] on the tool along them. A contact has one row, its normal,
/// or d rows: normal and tangents, or where contacts are many the axes x, y, z. n . r is the gap. W = J Xi
/// J^T + (compliance of the coupling), symmetric, positive definite. Asked for is, at each contact,
/// - held: r = 0 (with a compliance on W's diagonal: a spring);
/// - else r_n >= 0, lambda_n >= 0, r_n lambda_n = 0, and with friction mu: |lambda_t| <= mu lambda_n, and
/// where that
///   is an equality lambda_t is opposed to r_t, else r_t = 0 (Coulomb; r_t is what slides in this tick).
struct ContactProblem {
  /// Room for `max_contacts` contacts with `few_rows` rows in all where they are few, and `many_rows` where
  /// they are many.
  ContactProblem(int d, Index max_contacts, Index few_rows, Index many_rows);
  ContactProblem(int d, Index max_contacts, Index max_rows) : ContactProblem(d, max_contacts, max_rows, 0) {}

  /// Begins anew: no contact. `are_many`: those that come have their W in single precision.
  void clear(bool are_many = false) noexcept;
  /// Appends a contact whose normal in its rows is `n`. Its rows of b and lambda are zero.
  void add(double mu, bool is_held, const Vec3& n = Vec3::UnitX()) noexcept;
  /// Appends a contact without rows, which carries no force.
  void add_open() noexcept;
  /// Appends one held row that is there for a contact: where that is left out as open, so is the row.
  void add_held_row(Index owner) noexcept;

  [[nodiscard]] Index first_row(Index contact) const noexcept { return first[contact]; }
  [[nodiscard]] Index rows_of(Index contact) const noexcept {
    return first_row(contact + 1) - first_row(contact);
  }
  /// What a contact has of a vector along the rows, in its normal's direction.
  [[nodiscard]] double normal_part(Index contact, std::span<const double> of_rows) const noexcept;
  /// n . r of a contact by the present lambda: its gap, to first order [m].
  [[nodiscard]] double gap(Index contact) const noexcept;
  [[nodiscard]] double& w(Index i, Index j) noexcept { return W[place_in_w(i, j)]; }
  [[nodiscard]] double w(Index i, Index j) const noexcept { return W[place_in_w(i, j)]; }
  /// Row i of W, `rows` long.
  [[nodiscard]] const double* row(Index i) const noexcept {
    return W.data() + static_cast<std::ptrdiff_t>(i) * stride;
  }
  /// Row i of W where contacts are many: what body and couplings give way.
  [[nodiscard]] float* single_row(Index i) noexcept {
    return (coupled ? single_W : body_W).data() + static_cast<std::ptrdiff_t>(i) * single_stride;
  }
  [[nodiscard]] const float* single_row(Index i) const noexcept {
    return (coupled ? single_W : body_W).data() + static_cast<std::ptrdiff_t>(i) * single_stride;
  }
  /// Rows as far as single_row's products go: whole registers.
  [[nodiscard]] std::ptrdiff_t padded_rows() const noexcept { return std::ptrdiff_t{(rows + 15) / 16} * 16; }
  /// What the body alone has of it.
  [[nodiscard]] float* body_row(Index i) noexcept {
    return body_W.data() + static_cast<std::ptrdiff_t>(i) * single_stride;
  }

  int dimension;
  Index stride;         ///< of W
  Index single_stride;  ///< of single_W
  Index contacts = 0;
  Index rows = 0;
  bool frictionless = true;      ///< no contact has friction
  bool many = false;             ///< W is in single precision, and friction's rows are along the axes
  bool moves = false;            ///< a device, the body or its overlay has moved in this tick
  bool coupled = false;          ///< of many contacts: W with its couplings is in single_W; else it is body_W
  std::vector<Index> first;      ///< [contacts + 1]
  std::vector<double> friction;  ///< [contacts] mu
  std::vector<Vec3> normal;      ///< [contacts] in the rows' axes
  std::vector<std::uint8_t> held;  ///< [contacts]
  std::vector<Index> owner;        ///< [contacts] contact that a held row is there for, else -1
  std::vector<double> W;           ///< [rows x stride] [m/N]
  LargeVector<float> body_W;       ///< [rows x single_stride] where contacts are many [m/N]
  LargeVector<float> single_W;     ///< [rows x single_stride] with what couplings give way [m/N]
  std::vector<double> b;           ///< [rows] [m]; where contacts are many, r by the guess
  std::vector<double> lambda;      ///< [rows] [N]; before solving: a guess
  std::vector<double> guess;       ///< [rows] lambda before solving [N]
  std::vector<double> prediction;  ///< [rows] where contacts are many: expected change of lambda [N]

 private:
  [[nodiscard]] std::size_t place_in_w(Index i, Index j) const noexcept {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(j);
  }
  void append(double mu, bool is_held, Index owner_of, const Vec3& n, Index count) noexcept;
};

}  // namespace palpate
