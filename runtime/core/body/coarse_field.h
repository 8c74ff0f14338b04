// Coarse fields of displacement: quadratic polynomials on the cells of a grid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// A point in a coarse grid: its cell, and the values and slopes [1/m] there of the three polynomials along
/// each axis.
struct CoarsePlace {
  Index cell = 0;
  Vec3 x = Vec3::Zero();        ///< [m]
  Vec3 in_cell = Vec3::Zero();  ///< along each axis from -1 to 1 [-]
  std::array<Vec3, 3> value, slope;
};

/// Displacement of a coarse field at a place [m], and its gradient [-].
struct CoarseValue {
  Vec3 u = Vec3::Zero();
  Mat3 gradient = Mat3::Zero();
};

/// Displacement u = P q that is triquadratic in each cell of a grid (Lagrange's hexahedra of 27 nodes,
/// quadrilaterals of 9 in the plane) and continuous. The grid need not fit a body: a body is embedded in it.
/// Dof d k + axis of q belongs to coarse node k.
class CoarseField {
 public:
  /// Grid of `cells` along each axis over a box; in the plane one along z. Its nodes are those of cells that
  /// hold some of `points`.
  CoarseField(int dimension, const Vec3& low, const Vec3& high, const std::array<Index, 3>& cells,
              std::span<const Vec3> points);

  /// Leaves out the nodes whose values at the points others have too. Call at most once.
  void drop_dependent(std::span<const Vec3> points);

  [[nodiscard]] int dimension() const noexcept { return dimension_; }  ///< d
  [[nodiscard]] Index nodes() const noexcept { return nodes_; }
  /// Longest edge of a cell [m].
  [[nodiscard]] double edge() const noexcept { return edge_.head(dimension_).maxCoeff(); }
  [[nodiscard]] Eigen::Index dofs() const noexcept { return Eigen::Index{dimension_} * nodes_; }

  /// Place of a point in the box, or beside it, where the next cell's polynomials go on.
  [[nodiscard]] CoarsePlace place(const Vec3& x) const noexcept;

  /// P q and its gradient.
  [[nodiscard]] CoarseValue value(const CoarsePlace& at, std::span<const double> q) const noexcept;
  /// P q and its gradient, and P p, of fields in space side by side: [q_x q_y q_z 0 p_x p_y p_z 0] of each
  /// node.
  [[nodiscard]] std::pair<CoarseValue, Vec3> both(const CoarsePlace& at,
                                                  std::span<const double> q_and_p) const noexcept;

  /// Calls visit(node, weight, gradient) for each node of the place's cell: P and its gradient [1/m] there.
  template <class Visit>
  void for_each_node(const CoarsePlace& at, const Visit& visit) const noexcept {
    const Index* const node = nodes_of(at);
    for (int c = 0; c < (dimension_ == 3 ? 3 : 1); ++c) {
      for (int b = 0; b < 3; ++b) {
        for (int a = 0; a < 3; ++a) {
          const Index number = node[9 * c + 3 * b + a];
          if (number < 0) continue;
          const double x = at.value[a].x(), y = at.value[b].y(), z = at.value[c].z();
          visit(number, x * y * z,
                Vec3(at.slope[a].x() * y * z, x * at.slope[b].y() * z, x * y * at.slope[c].z()));
        }
      }
    }
  }

 private:
  [[nodiscard]] const Index* nodes_of(const CoarsePlace& at) const noexcept {
    return node_.data() + std::ptrdiff_t{at.cell} * 27;
  }

  int dimension_;
  Vec3 low_, edge_;
  std::array<Index, 3> cells_;
  Index nodes_ = 0;
  std::vector<Index> node_;  // [cells * 27] -1 where there is none
};

/// The finest grid for a body with these free nodes whose field has at most `most_dofs`.
CoarseField coarse_field(int dimension, std::span<const Vec3> nodes, Index most_dofs);

}  // namespace palpate
