// Which precision packed matrices are stored in, from the force error of touches.
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

/// A place of the surface and the up to 30 free surface nodes nearest to it, that node first.
struct TouchedPlace {
  std::vector<std::int64_t> dofs;      ///< [d m] stored dofs of those nodes
  RefinedSolution::Refined reference;  ///< [d m, d m] C = E^T K^-1 E in double and better [m/N]
  Eigen::MatrixXd plain;               ///< [d m, d m] as the columns are computed [m/N]
  std::vector<Vec3> arms;              ///< [m] of the nodes from the first [m]
};

/// Terms of W that split precision is tried with.
inline constexpr std::array<std::int64_t, 2> tried_terms = {16, 64};

/// W with the most terms that are tried, at most a quarter of the free stored dofs.
SmoothPart largest_smooth_part(const Factor& factor, const SparseMatrix& K,
                               std::span<const std::int64_t> stored_dofs);

/// Up to eight places: the four where rounding does most harm (where K's diagonal times the compliance is
/// largest, no two side by side) and four at random. Model: mesh, surface, held and stored nodes. `factor`:
/// of K, computed. The reference is refined where plain solves would be wrong by more than 1e-8 in the
/// forces.
std::vector<TouchedPlace> touched_places(const Model& model, const Factor& factor, const SparseMatrix& K,
                                         std::span<const std::int64_t> stored_dofs,
                                         const SmoothPart& largest);

/// Entry of C as it is stored: all of it, and the part that is rounded to the stored scalar.
struct StoredEntry {
  double value, rounded;
};
/// By place and two of its dofs.
using StoredEntries = std::function<StoredEntry(const TouchedPlace&, std::size_t, std::size_t)>;

/// The worst relative force error of touches. At each place 1, 2, 5 and 30 nodes (as many as there are) are
/// displaced by u: along each axis, by a linear field, and twice at random. f = C^-1 u from the entries, with
/// what the tick adds to the diagonal against rounding, 4 `rounding` of what is rounded; f_0 from the
/// reference. The error is max |f - f_0| / max |f_0| over the nodes; infinity where C is not positive
/// definite.
double force_error(std::span<const TouchedPlace> places, int dimension, const StoredEntries& entries,
                   double rounding);

/// The worst force error of a matrix as a file holds it.
double force_error(std::span<const TouchedPlace> places, int dimension, const PackedGreens& stored);

/// One packed matrix K^-1 of the stored dofs, before its columns are computed.
class PrecisionStudy {
 public:
  PrecisionStudy(const Model& model, const Factor& factor, const SparseMatrix& K,
                 std::span<const std::int64_t> stored_dofs);

  /// The worst force error in a precision, with `terms` columns of W where it is split.
  [[nodiscard]] double error(Precision precision, std::int64_t terms) const;
  /// Its W with that many columns.
  [[nodiscard]] std::shared_ptr<const SmoothPart> smooth(std::int64_t terms) const;

 private:
  int dimension_;
  SmoothPart smooth_;
  std::vector<TouchedPlace> places_;
};

/// What all packed matrices of a file are stored in.
struct PrecisionChoice {
  Precision precision = Precision::double_precision;
  std::int64_t terms = 0;           ///< of W, where it is split
  std::vector<ForceErrors> errors;  ///< of each matrix; those that were tried
};

/// `wanted`, or where it is empty the first of single, split with each number of terms, and double whose
/// force errors are at most good_force_error for all matrices; double where none is. Split that is wanted
/// takes the first number of terms that is good, else the last.
PrecisionChoice choose_precision(std::span<const PrecisionStudy> studies, std::optional<Precision> wanted);

/// "single 3.2e-03, split 1.5e-07": the worst of all matrices, what was measured.
std::string errors_text(std::span<const ForceErrors> errors);

}  // namespace palpate
