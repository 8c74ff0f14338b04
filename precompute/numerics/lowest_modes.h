// Free oscillations of a body (theory.md section 5).
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <vector>

#include "precompute/numerics/factor.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// The lowest solutions of K phi = omega^2 M phi.
struct Modes {
  std::vector<double> omega;  ///< [k + 1] angular frequencies [rad/s], ascending; the last is that of the
                              ///< first mode that is not among the shapes, infinity when there is none
  Eigen::MatrixXd shapes;     ///< [n, k] of the dofs of K, phi^T M phi = 1 [1/sqrt(kg)]; the entry of largest
                              ///< magnitude is positive
};

/// More dofs than these take too long to be solved densely.
inline constexpr std::int64_t most_dense_dofs = 2000;

/// Whether `count` modes of `dofs` are so many that all are computed.
bool dense_modes(std::int64_t count, std::int64_t dofs) noexcept;

/// Bytes that lowest_modes takes at most.
std::int64_t modes_bytes(std::int64_t count, std::int64_t dofs) noexcept;

/// The `count` <= n lowest modes, by block Lanczos on K^-1 M with thick restarts (Wu and Simon 2000), where
/// they are more than a third of all by a dense solver. `factor`: of K, computed. K and M: lower triangles.
/// That none is left out is proved by Sylvester's law of inertia. Bytes depend on no number of threads or
/// processes. Nothing where the sharing was stopped. Throws Error where they cannot be found.
std::optional<Modes> lowest_modes(const Factor& factor, const SparseMatrix& K, const SparseMatrix& M,
                                  std::int64_t count, Sharing& sharing);

/// How many omega^2 are below `square` [1/s^2]: the negative pivots of K - square M (Sylvester). `analysed`:
/// K. Throws Error where a pivot is zero.
std::int64_t modes_below(const Factor& analysed, const SparseMatrix& K, const SparseMatrix& M, double square);

/// Whether the `omega`, ascending, are the lowest with none left out: counted in a gap as high up among them
/// as there is one.
bool none_left_out(const Factor& analysed, const SparseMatrix& K, const SparseMatrix& M,
                   const std::vector<double>& omega);

}  // namespace palpate
