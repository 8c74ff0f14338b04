// Checks of packed and compressed matrices for `verify`.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "precompute/numerics/precision.h"

namespace palpate {

/// One check: its largest relative error and the bound that it must keep.
struct Check {
  std::string name;
  double error = 0.0;
  double bound = 0.0;
  [[nodiscard]] bool passed() const noexcept { return error <= bound; }  // false for NaN too
};

inline constexpr double solver_safety = 100.0;  ///< times `solver_error` is the allowed error of a column
inline constexpr double sum_rounding = 1e-13;   ///< of sums of products, relative to the largest
inline constexpr double same_sum = 1e-12;       ///< two sums of the same element integrals, relative

/// Rounding error of one stored entry, relative to the stored value (R with split precision).
double unit_roundoff(Precision precision) noexcept;

/// Difference between plain and refined solves with K, relative to the largest entry of each: the error that
/// the file's columns may have, however they are stored. From `samples` columns of the stored dofs.
double solver_error(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                    int samples);

/// Checks of A, as stored, against K^-1 with `factor` of K. Refined solves (refined_solve.h) stand for K^-1;
/// `solver`: see solver_error. Named NAME "columns", NAME "rows", NAME "touches":
/// - columns: `samples` columns, |A e - x|_max / |x|_max against two roundings, 1e-13 and a hundred times
/// `solver`;
/// - rows: y = A r for four vectors r of random signs against x = K^-1 r. If the only error of each entry is
/// its rounding, |y - x| of row i exceeds 8 times the rounding of |A_i|, its length, once in 10^13
/// (Hoeffding). The error is the largest |y - x| in units of that (and of the errors of the solver and the
/// sums). One entry that is wrong by more than twice the bound of its row or of its column is always found,
/// several in one row are missed with a probability of at most 1/16;
/// - touches: force_error against `measured`, the file's own value, four times; at least good_force_error.
std::vector<Check> verify_matrix(const Model& model, const PackedGreens& stored, const ForceErrors& measured,
                                 const Factor& factor, const SparseMatrix& K,
                                 std::span<const std::int64_t> stored_dofs, double solver,
                                 const std::string& name, int samples);

/// Checks of Green's functions in nested low-rank form against solves with `factor`: "columns", `samples` of
/// them as above, near pairs against two roundings and a hundred times `solver`, far ones, like "probes" and
/// "energy", against the tolerance of the file; "touches": the worst force error of random touches against
/// the tolerance.
std::vector<Check> verify_compressed(const Model& model, const Factor& factor,
                                     std::span<const std::int64_t> stored_dofs, double solver, int samples);

}  // namespace palpate
