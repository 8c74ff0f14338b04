// Free oscillations of a body (theory.md section 5).
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "precompute/numerics/factor.h"

namespace palpate {

/// Lowest solutions of K phi = omega^2 M phi.
struct LowestModes {
  std::vector<double> omega;  ///< [k + 1] angular frequencies [rad/s], ascending; the last is that of the
                              ///< first mode not among the shapes, infinity if there is none
  Eigen::MatrixXd shapes;     ///< [n, k] at the dofs of K, phi^T M phi = 1 [1/sqrt(kg)]; the entry of largest
                              ///< magnitude is positive
};

/// Largest number of dofs that is solved densely.
inline constexpr std::int64_t most_dense_dofs = 2000;

/// True if `count` modes of `dofs` are so many that all are computed.
bool dense_modes(std::int64_t count, std::int64_t dofs) noexcept;

/// Peak memory of lowest_modes [byte].
std::int64_t modes_bytes(std::int64_t count, std::int64_t dofs) noexcept;

/// The `count` <= n lowest modes, by Lanczos' method on K^-1 M with implicit restarts (Spectra), where they
/// are more than a third of all by a dense solver. `factor`: of K, computed. K and M: lower triangles. That
/// none is left out is proved by Sylvester's law of inertia. `stopped` is asked before each solve; nothing
/// once it is true. Throws Error where they cannot be found.
std::optional<LowestModes> lowest_modes(const Factor& factor, const SparseMatrix& K, const SparseMatrix& M,
                                        std::int64_t count, const std::function<bool()>& stopped);

/// Number of omega^2 below `square` [1/s^2]: the negative pivots of K - square M (Sylvester). `analysed`: K.
/// Throws Error if a pivot is zero.
std::int64_t modes_below(const Factor& analysed, const SparseMatrix& K, const SparseMatrix& M, double square);

/// True if the `omega`, ascending, are the lowest with none missing: counted in the highest gap among them.
bool none_left_out(const Factor& analysed, const SparseMatrix& K, const SparseMatrix& M,
                   const std::vector<double>& omega);

}  // namespace palpate
