// Green's functions in the form that the tick reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/vectors.h"
#include "matrices/node_range.h"
#include "matrices/packed.h"
#include "runtime/core/body/modes.h"

namespace palpate {

struct HierarchicalMatrix;

/// Largest number of terms added to the stored entries.
inline constexpr std::int64_t most_exact_terms = most_modes + most_smooth_terms;

/// Largest number of terms added to turned Green's functions.
inline constexpr Eigen::Index most_turned_terms = 6;

/// The layout of a packed matrix in memory.
struct GreensOptions {
  int jobs = 0;                        ///< threads for unfolding; 0: one per processor
  std::int64_t max_square_bytes = -1;  ///< limit for the full square; -1: half of the available memory
};

/// Terms in double on top of stored entries: left right^T [n x n].
struct ExactTerms {
  std::int64_t count = 0;
  std::shared_ptr<const double[]> left, right;  ///< [n x count] row-major

  [[nodiscard]] const double* left_row(std::int64_t dof) const noexcept { return left.get() + dof * count; }
  [[nodiscard]] const double* right_row(std::int64_t dof) const noexcept { return right.get() + dof * count; }
};

/// Compliance of a body: the Green's function matrix Xi = K^-1 [m/N] of the stored dofs, symmetric and
/// positive definite, in any form. Nodes are stored nodes; dof d k + axis, d = dimension(). All arithmetic is
/// in double. Const once made: any number of threads may use it, and nothing is allocated where `noexcept`.
class Greens {
 public:
  virtual ~Greens() = default;
  Greens(const Greens&) = delete;
  Greens& operator=(const Greens&) = delete;

  [[nodiscard]] std::int64_t order() const noexcept {
    return std::int64_t{dimension_} * nodes_;
  }                                                                    ///< n, dofs
  [[nodiscard]] int dimension() const noexcept { return dimension_; }  ///< d, dofs per node
  [[nodiscard]] Index nodes() const noexcept { return nodes_; }
  [[nodiscard]] Precision precision() const noexcept { return precision_; }
  /// Relative rounding error of a stored entry [-].
  [[nodiscard]] double rounding() const noexcept;

  /// Computes the block row of the capacitance matrix C = E^T Xi E (theory.md section 3) for `row`: the
  /// blocks at `columns` side by side. `blocks` is d x dm, row-major, for m columns.
  virtual void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept = 0;

  /// u = Xi E f (theory.md section 3) for ranges of nodes, one after the other in `u` [m], by the forces f
  /// [dm] on m nodes [N].
  virtual void displacement(std::span<const Index> nodes, std::span<const double> f,
                            std::span<const NodeRange> ranges, std::span<double> u) const noexcept = 0;
  /// For the u.size() / d stored nodes from `first_node` on.
  void displacement(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                    std::span<double> u) const noexcept;
  /// For all of them: u [n].
  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<double> u) const noexcept;

  /// Block of Xi at (row, column) [d, d] [m/N]: displacement of node `row` by unit forces on node `column`.
  /// Not for the tick: allocates.
  [[nodiscard]] Eigen::MatrixXd block(Index row, Index column) const;

  /// Displacement q of the coarse field [n_q] by the forces of Green's functions on two levels
  /// (TwoLevelState); nothing for others.
  virtual void coarse_displacement(std::span<const Index> nodes, std::span<const double> f,
                                   std::span<double> q) const noexcept;

  /// Rotation of a node, with which its compliance has turned.
  [[nodiscard]] virtual const Mat3& rotation(Index node) const noexcept;
  /// Terms in double beside the stored entries; null: none.
  [[nodiscard]] virtual const ExactTerms* exact_terms() const noexcept { return nullptr; }
  /// False where packed storage is used as it is, which is much slower, and for compressed ones.
  [[nodiscard]] virtual bool unfolded() const noexcept { return false; }
  /// Null unless the form is nested low-rank, which then is exact only to its certificate.
  [[nodiscard]] virtual const HierarchicalMatrix* compressed_form() const noexcept { return nullptr; }

 protected:
  Greens(int dimension, Index nodes, Precision precision)
      : dimension_(dimension), nodes_(nodes), precision_(precision) {}

 private:
  int dimension_;
  Index nodes_;
  Precision precision_;
};

/// Green's functions of a packed matrix, unfolded into a full square when memory allows: what a tick needs of
/// a node is then d rows, contiguous in memory (Xi is symmetric), where a packed column jumps through the
/// whole array. `dimension`: 2 or 3. Throws Error when the order is not that many for each of some nodes.
std::shared_ptr<const Greens> make_greens(PackedGreens packed, int dimension,
                                          const GreensOptions& options = {});

/// Matrix in nested low-rank form, used as it is.
std::shared_ptr<const Greens> make_greens(std::shared_ptr<const HierarchicalMatrix> compressed);

/// Adds terms to Green's functions, after the terms that they have already.
std::shared_ptr<const Greens> with_terms(std::shared_ptr<const Greens> greens, const ExactTerms& terms);

/// Xi + sum_i weights_i phi_i phi_i^T: with weights 1 / k_bar_i - 1 / omega_i^2 that is K_bar^-1 of the
/// modes, and the static response of the rest (theory.md section 5, modal form with static
/// correction). Modes of the same dofs.
std::shared_ptr<const Greens> with_modes(std::shared_ptr<const Greens> greens, const Modes& modes,
                                         std::span<const double> weights);

/// R_i Xi_ij R_j^T + left right^T: forces and displacement of each node turned by its rotation [nodes], and
/// up to `most_turned_terms` terms [n x terms] on top, which are not turned.
std::shared_ptr<const Greens> turned(std::shared_ptr<const Greens> greens, std::vector<Mat3> rotations,
                                     const Eigen::MatrixXd& left = {}, const Eigen::MatrixXd& right = {});

}  // namespace palpate
