// Bound of the force error that the approximation of a matrix in nested low-rank form causes.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "matrices/hierarchical.h"

namespace palpate {

/// Bounds of y^T E f, where E is Xi minus the stored matrix, f the forces of a touch and y the forces that a
/// unit motion of the tool adds. To first order y^T E f is the error of the touch's total force along the
/// motion: Xi F = (Xi - E) f gives y^T Xi (F - f) = - y^T E f.
///
/// Forces are weighted on each leaf by its own Xi_a, which is exact: |f_a|^2 = f_a^T Xi_a f_a; for a cluster
/// it is the sum over its leaves. In these norms E of a far pair (a, b) has the Frobenius norm e = pair_error
/// and n_a x n_b entries that behave as if random: the sum
///
///   s^2 = sum over far pairs of e_ab^2 / (n_a n_b) (|y_a|^2 |f_b|^2 + |y_b|^2 |f_a|^2)
///
/// is the expected square, and the bound is 24 s. It is no proof. The largest of many thousand measured
/// errors were 21 s (docs/measurements/size.md), and precompute scales pair_error so that its own measured
/// errors stay below half of the bound.
///
/// Allocates in the constructor only.
class ErrorBound {
 public:
  /// Reserves memory for loads on `most_nodes` nodes. Keeps a reference to the matrix, which copies share.
  ErrorBound(const HierarchicalMatrix& matrix, std::size_t most_nodes);

  /// Sets the forces f [d m] on m stored nodes [N]; a node may occur several times. Nodes beyond most_nodes
  /// are ignored.
  void carry(std::span<const Index> nodes, std::span<const double> f) noexcept;

  /// Bound of y^T E f [N m], with forces y [d m] on m stored nodes.
  [[nodiscard]] double work(std::span<const Index> nodes, std::span<const double> y) noexcept;

 private:
  /// A cluster on which forces act.
  struct Loaded {
    Index cluster;
    double squared;  ///< |f|^2
  };
  /// Loaded clusters of each level, ascending.
  struct Load {
    std::vector<Loaded> clusters;                                     // [most nodes x levels]
    std::array<std::array<std::size_t, 2>, most_levels + 1> range{};  // of each level

    [[nodiscard]] std::span<const Loaded> level(int l) const noexcept {
      const auto [begin, end] = range[static_cast<std::size_t>(l)];
      return std::span(clusters).subspan(begin, end - begin);
    }
  };

  /// Mean square of the weighted entries of a far pair.
  [[nodiscard]] double mean_square(Index pair) const noexcept;
  /// s^2 for two loads.
  [[nodiscard]] double mean_square(const Load& y, const Load& f) const noexcept;
  void weigh(std::span<const Index> nodes, std::span<const double> f, Load& load) noexcept;
  [[nodiscard]] double squared_of_leaf(Index leaf, std::span<const Index> places,
                                       std::span<const Index> nodes,
                                       std::span<const double> f) const noexcept;

  const HierarchicalMatrix* matrix_;
  std::vector<Index> places_;        // [most nodes] positions in the last weighted load, sorted by leaf
  std::vector<Index> sorted_nodes_;  // [most nodes] its nodes: those of f and y are mostly the same
  std::size_t sorted_ = 0;
  bool stays_near_ = false;  // no nodes of f are far from each other, and they were sorted last
  Load carried_, tried_;
};

}  // namespace palpate
