// Capacitance matrix of a contact, as its Cholesky factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Result of adding a node.
enum class CapacitanceStatus : std::uint8_t {
  ok,
  full,                   ///< `max_nodes` are held already
  not_positive_definite,  ///< the new node does not move independently of the held ones (for example held
                          ///< twice: a pivot within CapacitanceMatrix::pivot_tolerance), or entries are not
                          ///< finite
};

/// C = E^T Xi E [m/N] of m held nodes (theory.md section 3; James & Pai 2001), stored as its Cholesky factor
/// L, C = L L^T. The factor is updated when nodes are added or removed, in O(m^2), and never recomputed. A
/// node has d = dimension() dofs; 1: single rows, e.g. the normals of frictionless contacts. All memory is
/// allocated at construction; copies keep the capacity.
class CapacitanceMatrix {
 public:
  /// Smallest pivot, relative to the diagonal of C, that is not treated as rounding.
  static constexpr double pivot_tolerance = 1e-10;

  /// `dimension`: dofs per node, 1 to 3. Capacity of `max_nodes` nodes. Throws Error for another dimension or
  /// no capacity.
  CapacitanceMatrix(int dimension, Index max_nodes);

  [[nodiscard]] int dimension() const noexcept { return dimension_; }  ///< d
  [[nodiscard]] Index nodes() const noexcept { return nodes_; }        ///< m
  [[nodiscard]] Index max_nodes() const noexcept { return max_nodes_; }

  /// Appends a node. `blocks` is its block row of C, the m blocks at the held nodes and then its own, d x
  /// d(m+1), row-major (as from Greens::gather). Unchanged unless ok.
  [[nodiscard]] CapacitanceStatus add(std::span<const double> blocks) noexcept;

  /// Holds `nodes` nodes at once, instead of the present ones: `lower` is C, lower packed by columns
  /// (matrices/packed.h). Same result as adding them one by one except for rounding, in a third of the time.
  /// Holds none unless ok.
  [[nodiscard]] CapacitanceStatus assign(Index nodes, std::span<const double> lower) noexcept;

  /// Removes the node at position k, 0 <= k < m; later ones move up by one.
  void remove(Index k) noexcept;

  /// Removes all nodes.
  void clear() noexcept { nodes_ = 0; }

  /// Solves C f = u in place: `x` [dm] is u [m] before and f [N] after.
  void solve(std::span<double> x) const noexcept;

  /// Solves C f = u for up to three right-hand sides, concatenated in `x` [systems x dm]: L is read once.
  void solve(std::span<double> x, int systems) const noexcept;

  /// Entry (i, j), i >= j, of L.
  [[nodiscard]] double factor(std::int64_t i, std::int64_t j) const noexcept { return column(j)[i - j]; }

 private:
  [[nodiscard]] double* column(std::int64_t j) noexcept;
  [[nodiscard]] const double* column(std::int64_t j) const noexcept;

  // Algorithms for D = d dofs per node as a compile-time constant.
  template <int D>
  CapacitanceStatus add_node(std::span<const double> blocks) noexcept;
  template <int D>
  void remove_node(Index k) noexcept;
  template <int D>
  void eliminate(std::int64_t j, double* y, std::int64_t rows) const noexcept;
  template <int S>
  void solve_systems(double* x) const noexcept;

  bool factor_panel(std::int64_t first, std::int64_t end, std::int64_t rows) noexcept;
  void subtract_panel(std::int64_t first, std::int64_t rows) noexcept;

  int dimension_;
  Index max_nodes_;
  Index nodes_ = 0;
  std::int64_t capacity_;     // in dofs
  std::vector<double> L_;     // lower packed for the order `capacity_`: column j starts at its diagonal
  std::vector<double> rows_;  // [d x capacity_] rows to be added or columns to be removed
};

}  // namespace palpate
