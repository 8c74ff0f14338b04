// How far off forces may be by what is missing from a matrix in nested low-rank form.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "matrices/hierarchical.h"

namespace palpate {

/// Bounds of y^T E f, E = Xi less what is stored, where f are the forces of a touch and y those that a motion
/// of the tool by 1 adds. To first order that is what the touch's total force is off by along the motion:
/// from Xi F = (Xi - E) f follows y^T Xi (F - f) = - y^T E f.
///
/// On each leaf forces are weighed by its own Xi_a, which is exact: |f_a|^2 = f_a^T Xi_a f_a, and of a
/// cluster the sum over its leaves. So weighed, E of a far pair (a, b) has Frobenius' norm e = pair_error and
/// n_a x n_b entries, which are as good as random: the sum
///
///   s^2 = sum over far pairs of e_ab^2 / (n_a n_b) (|y_a|^2 |f_b|^2 + |y_b|^2 |f_a|^2)
///
/// is the square of what is to be expected, and the bound is 24 s. It is no proof. Largest of many thousand
/// measured errors were 21 s (docs/measurements/size.md), and precompute makes pair_error so large that what
/// it measures stays below half of the bound.
///
/// Nothing is allocated once it is made.
class ErrorBound {
 public:
  /// Room for loads on `most_nodes` nodes. The matrix is kept by reference, copies share it.
  ErrorBound(const HierarchicalMatrix& matrix, std::size_t most_nodes);

  /// The forces f [d m] on m stored nodes [N]; a node may be there several times. Of more nodes than there is
  /// room for the first ones.
  void carry(std::span<const Index> nodes, std::span<const double> f) noexcept;

  /// Bound of y^T E f [N m], with forces y [d m] on m stored nodes.
  [[nodiscard]] double work(std::span<const Index> nodes, std::span<const double> y) noexcept;

 private:
  /// A cluster on which forces act.
  struct Loaded {
    Index cluster;
    double squared;  ///< |f|^2
  };
  /// The clusters of each level, ascending.
  struct Load {
    std::vector<Loaded> clusters;                                     // [most nodes x levels]
    std::array<std::array<std::size_t, 2>, most_levels + 1> range{};  // of each level

    [[nodiscard]] std::span<const Loaded> level(int l) const noexcept {
      const auto [begin, end] = range[static_cast<std::size_t>(l)];
      return std::span(clusters).subspan(begin, end - begin);
    }
  };

  /// What the square of an entry of a pair, so weighed, is in the mean.
  [[nodiscard]] double mean_square(Index pair) const noexcept;
  /// s^2 of two loads.
  [[nodiscard]] double mean_square(const Load& y, const Load& f) const noexcept;
  void weigh(std::span<const Index> nodes, std::span<const double> f, Load& load) noexcept;
  [[nodiscard]] double squared_of_leaf(Index leaf, std::span<const Index> places,
                                       std::span<const Index> nodes,
                                       std::span<const double> f) const noexcept;

  const HierarchicalMatrix* matrix_;
  std::vector<Index> places_;        // [most nodes] of the nodes of the load that was weighed last, by leaves
  std::vector<Index> sorted_nodes_;  // [most nodes] its nodes: those of f and y are mostly the same
  std::size_t sorted_ = 0;
  bool stays_near_ = false;  // no nodes of f are far from each other, and they were sorted last
  Load carried_, tried_;
};

}  // namespace palpate
