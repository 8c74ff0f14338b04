// Green's functions in the form that the tick reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "formats/packed.h"
#include "matrices/node_range.h"
#include "meshes/mesh.h"
#include "runtime/body/modes.h"

namespace palpate {

struct HierarchicalMatrix;

/// Largest number of terms added to the stored entries.
inline constexpr std::int64_t most_exact_terms = most_modes + most_smooth_terms;

/// Largest number of terms added to turned Green's functions.
inline constexpr Eigen::Index most_turned_terms = 6;

/// Memory layout of `Greens`.
struct GreensOptions {
  int jobs = 0;                        ///< threads for unfolding; 0: one per processor
  std::int64_t max_square_bytes = -1;  ///< limit for the full square; -1: half of the available memory
};

/// Green's function matrix Xi = K^-1 [m/N] of the stored degrees of freedom, unfolded from packed storage
/// into a full square if memory allows. A node's data are then d rows, contiguous in memory (Xi is
/// symmetric), whereas a packed column is scattered over the whole array. Nodes are stored nodes
/// (Model::stored_nodes); dof d k + axis, d = dimension(). All arithmetic is in double. Constant once built:
/// any number of threads may use it.
class Greens {
 public:
  /// `dimension`: degrees of freedom per node, 2 or 3. Throws Error if the order is not a multiple of it.
  Greens(PackedGreens packed, int dimension, const GreensOptions& options = {});

  /// Matrix in nested low-rank form, used as it is.
  explicit Greens(std::shared_ptr<const HierarchicalMatrix> compressed);

  /// Adds sum_i weights_i phi_i phi_i^T to Xi. With weights 1 / k_bar_i - 1 / omega_i^2 the result is
  /// K_bar^-1 for the modes, and the static response for the rest (theory.md section 5, modal form with
  /// static correction). The modes have the same dofs.
  void add_modes(const Modes& modes, std::span<const double> weights);

  /// Returns R_i Xi_ij R_j^T + left right^T, sharing the memory: forces and displacement of each node are
  /// rotated by its rotation [nodes], and up to `most_turned_terms` terms [n x terms] are added without
  /// rotation.
  [[nodiscard]] Greens turned(std::vector<Mat3> rotations, const Eigen::MatrixXd& left = {},
                              const Eigen::MatrixXd& right = {}) const;

  [[nodiscard]] std::int64_t order() const noexcept { return order_; }  ///< n, number of stored dofs
  [[nodiscard]] int dimension() const noexcept { return dimension_; }   ///< d, dofs per node
  [[nodiscard]] Index nodes() const noexcept { return nodes_; }
  [[nodiscard]] Precision precision() const noexcept { return precision_; }
  /// Relative rounding error of a stored entry [-].
  [[nodiscard]] double rounding() const noexcept;
  /// True for split precision: some terms of Xi are stored in double beside the entries.
  [[nodiscard]] bool split() const noexcept { return split_; }
  /// Number of terms in double added to the stored entries: W W^T and those of modes.
  [[nodiscard]] std::int64_t exact_terms() const noexcept { return terms_; }
  /// [exact_terms] Row of a dof: the dot product of both rows is added to entry (row, column).
  [[nodiscard]] const double* exact_left(std::int64_t row) const noexcept {
    return left_.get() + row * terms_;
  }
  [[nodiscard]] const double* exact_right(std::int64_t column) const noexcept {
    return right_.get() + column * terms_;
  }
  [[nodiscard]] bool unfolded() const noexcept {
    return square_ != nullptr;
  }  ///< false: used in packed form, much slower, or compressed
  [[nodiscard]] bool compressed() const noexcept { return compressed_ != nullptr; }
  [[nodiscard]] std::int64_t compressed_bytes() const noexcept;  ///< 0 if not compressed
  /// Compressed form; null if not compressed.
  [[nodiscard]] const HierarchicalMatrix* compressed_form() const noexcept { return compressed_.get(); }

  /// Block of Xi at (row, column) [d, d] [m/N]: displacement of node `row` by unit forces on node `column`.
  /// Not for the tick: allocates.
  [[nodiscard]] Eigen::MatrixXd block(Index row, Index column) const;

  /// Computes the block row of the capacitance matrix C = E^T Xi E (theory.md section 3) for `row`: the
  /// blocks at `columns` side by side. `blocks` is d x dm, row-major, for m columns.
  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept;

  /// u = Xi E f (theory.md section 3): displacement u [n] of all stored dofs [m] by the forces f [dm] on m
  /// nodes [N].
  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<double> u) const noexcept;

  /// Displacement of some nodes: `u` is the displacement of the u.size() / d stored nodes from `first_node`
  /// on.
  void displacement(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                    std::span<double> u) const noexcept;

  /// Displacement of ranges of nodes, concatenated in `u`.
  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept;

 private:
  void gather_unturned(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept;
  void turn_blocks(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept;
  void displace_unturned(std::span<const Index> nodes, std::span<const double> f,
                         std::span<const NodeRange> ranges, std::span<double> u) const noexcept;
  void displace_turned(std::span<const Index> nodes, std::span<const double> f,
                       std::span<const NodeRange> ranges, std::span<double> u) const noexcept;
  void gather_static(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept;
  void displace_statically(std::span<const Index> nodes, std::span<const double> f,
                           std::span<const NodeRange> ranges, std::span<double> u) const noexcept;
  void displace_statically(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                           std::span<double> u) const noexcept;
  void add_exact_terms(std::span<const Index> nodes, std::span<const double> f,
                       std::span<const NodeRange> ranges, std::span<double> u) const noexcept;

  PackedGreens packed_;  // empty if unfolded: replaced by the square
  std::shared_ptr<const HierarchicalMatrix> compressed_;
  std::shared_ptr<const void> square_;  // [n x stride_] rows of the stored scalar
  std::int64_t order_ = 0;
  std::int64_t stride_ = 0;  // distance between rows of the square [scalars]
  int dimension_ = 3;
  Index nodes_ = 0;
  Precision precision_ = Precision::double_precision;
  // left right^T is added to the stored entries: W W^T of split precision, then the weighted modes.
  bool split_;
  std::int64_t terms_ = 0;
  std::shared_ptr<const double[]> left_, right_;  // [n x terms_]; the same array if there is W alone
  struct Turning {
    std::vector<Mat3> rotations;                                                         // [nodes]
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> left, right;  // [n x terms]
  };
  std::shared_ptr<const Turning> turning_;  // null if not turned
};

}  // namespace palpate
