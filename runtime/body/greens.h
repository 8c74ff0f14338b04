// The Green's functions as the tick reads them.
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

/// Most terms that come on top of the stored entries.
inline constexpr std::int64_t most_exact_terms = most_modes + most_smooth_terms;

/// Most terms on top of turned Green's functions.
inline constexpr Eigen::Index most_turned_terms = 6;

/// How `Greens` is laid out in memory.
struct GreensOptions {
  int jobs = 0;  ///< threads that unfold; 0: one for each processor
  std::int64_t max_square_bytes =
      -1;  ///< most that the full square may take; -1: half of the memory that is available
};

/// The Green's function matrix Xi = K^-1 [m/N] of the stored dofs, unfolded from packed storage into a full
/// square when memory allows: what a tick needs of a node is then d rows, contiguous in memory (Xi is
/// symmetric), where a packed column jumps through the whole array. Nodes are stored nodes
/// (Model::stored_nodes); dof d k + axis, d = dimension(). All arithmetic is in double. Const once built: any
/// number of threads may use it.
class Greens {
 public:
  /// `dimension`: dofs a node, 2 or 3. Throws Error when the order is not that many for each of some nodes.
  Greens(PackedGreens packed, int dimension, const GreensOptions& options = {});

  /// A matrix in nested low-rank form, which stays as it is.
  explicit Greens(std::shared_ptr<const HierarchicalMatrix> compressed);

  /// From now on Xi + sum_i weights_i phi_i phi_i^T: with weights 1 / k_bar_i - 1 / omega_i^2 that is
  /// K_bar^-1 of the modes, and of what they do not carry the static response (theory.md section 5, modal
  /// form with static correction). Modes of the same dofs.
  void add_modes(const Modes& modes, std::span<const double> weights);

  /// R_i Xi_ij R_j^T + left right^T in the same memory: forces and displacement of each node turned by its
  /// rotation [nodes], and up to `most_turned_terms` terms [n x terms] on top, which are not turned.
  [[nodiscard]] Greens turned(std::vector<Mat3> rotations, const Eigen::MatrixXd& left = {},
                              const Eigen::MatrixXd& right = {}) const;

  [[nodiscard]] std::int64_t order() const noexcept { return order_; }  ///< n, number of stored dofs
  [[nodiscard]] int dimension() const noexcept { return dimension_; }   ///< d, dofs a node
  [[nodiscard]] Index nodes() const noexcept { return nodes_; }
  [[nodiscard]] Precision precision() const noexcept { return precision_; }
  /// Rounding of a stored entry, relative to it [-].
  [[nodiscard]] double rounding() const noexcept;
  /// Whether the precision is split: then some terms of Xi are in double beside the stored entries.
  [[nodiscard]] bool split() const noexcept { return split_; }
  /// Terms that come in double on top of the stored entries: W W^T and those of modes.
  [[nodiscard]] std::int64_t exact_terms() const noexcept { return terms_; }
  /// [exact_terms] Rows of a dof: the sum of their products is what comes on top of entry (row, column).
  [[nodiscard]] const double* exact_left(std::int64_t row) const noexcept {
    return left_.get() + row * terms_;
  }
  [[nodiscard]] const double* exact_right(std::int64_t column) const noexcept {
    return right_.get() + column * terms_;
  }
  [[nodiscard]] bool unfolded() const noexcept {
    return square_ != nullptr;
  }  ///< false: used packed, much slower, or compressed
  [[nodiscard]] bool compressed() const noexcept { return compressed_ != nullptr; }
  [[nodiscard]] std::int64_t compressed_bytes() const noexcept;  ///< 0 where it is not
  /// The stored form, null where it is not compressed.
  [[nodiscard]] const HierarchicalMatrix* compressed_form() const noexcept { return compressed_.get(); }

  /// Xi at (row, column) [d, d] [m/N]: displacement of node `row` by unit forces on node `column`. Not for
  /// the tick: takes memory.
  [[nodiscard]] Eigen::MatrixXd block(Index row, Index column) const;

  /// The block row of the capacitance matrix C = E^T Xi E (theory.md section 3) that belongs to `row`: its
  /// blocks at `columns` one beside the other, `blocks` is d x dm, row-major, for m columns.
  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept;

  /// u = Xi E f (theory.md section 3): displacement u [n] of all stored dofs [m] by the forces f [dm] on m
  /// nodes [N].
  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<double> u) const noexcept;

  /// Displacement of a part of the nodes: `u` is the displacement of the u.size() / d stored nodes from
  /// `first_node` on.
  void displacement(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                    std::span<double> u) const noexcept;

  /// Displacement of ranges of nodes, one after the other in `u`.
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

  PackedGreens packed_;  // empty when unfolded: the square has taken its place
  std::shared_ptr<const HierarchicalMatrix> compressed_;
  std::shared_ptr<const void> square_;  // [n x stride_] rows of the stored scalar
  std::int64_t order_ = 0;
  std::int64_t stride_ = 0;  // scalars from one row of the square to the next
  int dimension_ = 3;
  Index nodes_ = 0;
  Precision precision_ = Precision::double_precision;
  // left right^T comes on top of what is stored: W W^T of split precision, then the weighted modes.
  bool split_;
  std::int64_t terms_ = 0;
  std::shared_ptr<const double[]> left_, right_;  // [n x terms_] one and the same for W alone
  struct Turning {
    std::vector<Mat3> rotations;                                                         // [nodes]
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> left, right;  // [n x terms]
  };
  std::shared_ptr<const Turning> turning_;  // null: none
};

}  // namespace palpate
