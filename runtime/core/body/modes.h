// Lowest modes of the body in the form that the tick reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Largest number of modes: a tick keeps as many numbers on its stack.
inline constexpr Index most_modes = 2048;

/// Modes K phi_i = omega_i^2 M phi_i, phi_i^T M phi_i = 1 (theory.md section 5), i < k, at the stored dofs.
/// The data of a dof are one row, contiguous in memory.
class Modes {
 public:
  /// `omega` [k + 1] angular frequencies [rad/s], the last that of the first mode that is not kept (infinity
  /// when all are); `shapes` [k x n].
  Modes(int dimension, std::span<const double> omega, std::span<const double> shapes);

  [[nodiscard]] Index count() const noexcept { return count_; }  ///< k
  [[nodiscard]] int dimension() const noexcept { return dimension_; }
  /// [k] angular frequencies [rad/s].
  [[nodiscard]] std::span<const double> omega() const noexcept { return omega_; }
  /// Angular frequency of the first mode that is not stored [rad/s]; infinity if all are.
  [[nodiscard]] double first_dropped_omega() const noexcept { return first_dropped_omega_; }

  /// [k] values of the modes at a stored dof [1/sqrt(kg)].
  [[nodiscard]] const double* row(std::int64_t dof) const noexcept {
    return rows_.data() + dof * std::ptrdiff_t{count_};
  }

  /// Adds factor phi_i^T E f to `modal` [k], for forces f [dm] on m stored nodes [N].
  void add_projection(std::span<const Index> nodes, std::span<const double> f, double factor,
                      std::span<double> modal) const noexcept;

  /// Displacement u [m] of a stored node for modal coordinates q [k].
  [[nodiscard]] Vec3 displacement(Index stored, std::span<const double> q) const noexcept;

 private:
  int dimension_;
  Index count_;
  std::vector<double> omega_;
  double first_dropped_omega_;
  std::vector<double> rows_;  // [n x k]
};

}  // namespace palpate
