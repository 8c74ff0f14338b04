// Choice of the precision of packed matrices by the force error of touches.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/model.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/refined_solve.h"

namespace palpate {

/// A place of the surface with the up to 30 nearest free surface nodes, its own node first.
struct TouchedPlace {
  std::vector<std::int64_t> dofs;      ///< [d m] stored dofs of those nodes
  RefinedSolution::Refined reference;  ///< [d m, d m] C = E^T K^-1 E in double and better [m/N]
  Eigen::MatrixXd plain;               ///< [d m, d m] as the columns are computed, without refinement [m/N]
  std::vector<Vec3> arms;              ///< [m] of the nodes from the first [m]
};

/// Numbers of terms of W that are tried for split precision.
inline constexpr std::array<std::int64_t, 2> tried_terms = {16, 64};

/// W with the largest tried number of terms, at most a quarter of the free stored dofs.
SmoothPart largest_smooth_part(const Factor& factor, const SparseMatrix& K,
                               std::span<const std::int64_t> stored_dofs);

/// Up to eight places: the four where rounding does most harm (with the largest product of K's diagonal and
/// the compliance, no two adjacent) and four at random. Model: mesh, surface, held and stored nodes.
/// `factor`: of K, computed. The reference is refined if plain solves cause force errors above 1e-8.
std::vector<TouchedPlace> touched_places(const Model& model, const Factor& factor, const SparseMatrix& K,
                                         std::span<const std::int64_t> stored_dofs,
                                         const SmoothPart& largest);

/// Entry of C as stored: its value, and the part that is rounded to the stored scalar.
struct StoredEntry {
  double value, rounded;
};
/// Stored entries by place and two of its dofs.
using StoredEntries = std::function<StoredEntry(const TouchedPlace&, std::size_t, std::size_t)>;

/// Worst relative force error of touches. At each place 1, 2, 5 and 30 nodes (as many as there are) are
/// displaced by u: along each axis, by a linear field, and twice at random. f = C^-1 u from the entries, with
/// the tick's addition to the diagonal against rounding, 4 `rounding` of the rounded part; f_0 from the
/// reference. The error is max |f - f_0| / max |f_0| over the nodes; infinity if C is not positive definite.
double force_error(std::span<const TouchedPlace> places, int dimension, const StoredEntries& entries,
                   double rounding);

/// Worst force error of a matrix as stored in a file.
double force_error(std::span<const TouchedPlace> places, int dimension, const PackedGreens& stored);

/// Study of one packed matrix K^-1 of the stored dofs, before its columns are computed.
class PrecisionStudy {
 public:
  PrecisionStudy(const Model& model, const Factor& factor, const SparseMatrix& K,
                 std::span<const std::int64_t> stored_dofs);

  /// Worst force error in a precision, with `terms` columns of W if it is split.
  [[nodiscard]] double error(Precision precision, std::int64_t terms) const;
  /// W with that many columns.
  [[nodiscard]] std::shared_ptr<const SmoothPart> smooth(std::int64_t terms) const;

 private:
  int dimension_;
  SmoothPart smooth_;
  std::vector<TouchedPlace> places_;
};

/// Precision of all packed matrices of a file.
struct PrecisionChoice {
  Precision precision = Precision::double_precision;
  std::int64_t terms = 0;           ///< of W, if split
  std::vector<ForceErrors> errors;  ///< of each matrix, for the tried precisions
};

/// `wanted` or, if it is empty, the first of single, split with each number of terms, and double whose force
/// errors are at most good_force_error for all matrices; double if none is. If split is wanted, it gets the
/// first number of terms that is good enough, else the last.
PrecisionChoice choose_precision(std::span<const PrecisionStudy> studies, std::optional<Precision> wanted);

/// Measured errors, the worst of all matrices: "single 3.2e-03, split 1.5e-07".
std::string errors_text(std::span<const ForceErrors> errors);

}  // namespace palpate
