// Spatial search on a moving surface.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vectors.h"
#include "runtime/core/solve/nearest_point.h"

namespace palpate {

/// Simplex of the surface with its point nearest to a query.
struct NearestSimplex {
  Index simplex = -1;
  NearestPoint nearest;
};

/// Bounding volume tree over the simplices of a surface whose nodes move. Boxes are larger than their
/// contents by a margin: a node that moves by less costs nothing, others cost the paths from their leaves to
/// the root, each cell once. The whole tree is never refitted, and boxes shrink as well as grow. All memory
/// is allocated at construction; no call allocates.
class SurfaceTree {
 public:
  /// `simplices`: [F * corners] nodes of triangles (corners = 3) or lines (2); `positions`: [S] of the nodes
  /// [m]; `margin`: enlargement of the boxes [m]. Throws Error if there is no simplex, or unless margin > 0.
  SurfaceTree(std::span<const Index> simplices, int corners, std::span<const Vec3> positions, double margin);

  /// Present position of the node [m].
  [[nodiscard]] const Vec3& position(Index node) const noexcept { return positions_[node]; }

  /// Moves a node; `position` must be finite. The boxes are updated by `refit`.
  void move(Index node, const Vec3& position) noexcept;

  /// Updates the boxes of all moved nodes. Call it before a query.
  void refit() noexcept;

  /// Box around the whole surface, at most two margins larger on each side [m].
  [[nodiscard]] Eigen::AlignedBox3d bounds() const noexcept {
    return {cells_.front().lower, cells_.front().upper};
  }

  /// Finds all simplices whose own box (without margin) is within `reach` of the box of segment p q, which
  /// must be finite. Fills `found` in an order that depends only on the surface at construction, and returns
  /// their number, which may exceed the size of `found`.
  [[nodiscard]] std::size_t near_segment(const Vec3& p, const Vec3& q, double reach,
                                         std::span<Index> found) const noexcept;

  /// Simplex nearest to a point, which must be finite, at present positions.
  [[nodiscard]] NearestSimplex nearest(const Vec3& point) const noexcept;

  /// True if a point (in the plane with z = 0) is inside the surface, which must be closed: by the
  /// angle-weighted normal of the nearest vertex, edge or face (Baerentzen & Aanaes 2005). A point on the
  /// surface, within rounding, is not inside.
  [[nodiscard]] bool inside(const Vec3& point) const noexcept;

 private:
  /// Box of a leaf with the simplices at places [first, first + count), or of two children: the next cell and
  /// the cell at the end of that one.
  struct Cell {
    Vec3 lower, upper;
    Index end;     // cell after all descendants
    Index parent;  // -1 for the root
    Index first;
    Index count;  // 0 if not a leaf
  };

  void build(std::span<const Vec3> centres, Index first, Index last, Index parent);
  void connect_nodes();

  /// Sets the box of a cell from its contents; false if it is unchanged.
  bool fit(Index cell) noexcept;
  void mark(Index cell) noexcept;

  [[nodiscard]] std::span<const Index> nodes_at(Index place) const noexcept;
  [[nodiscard]] std::span<const Index> places_around(Index node) const noexcept;
  [[nodiscard]] Index nearest_place(const Vec3& point, NearestPoint& nearest) const noexcept;
  [[nodiscard]] Vec3 outward_normal(Index place, const NearestPoint& nearest) const noexcept;
  [[nodiscard]] Vec3 unit_normal(Index place) const noexcept;
  [[nodiscard]] double angle(Index place, Index node) const noexcept;

  int corners_;
  double margin_;
  std::vector<Vec3> positions_;       // [S]
  std::vector<Vec3> anchors_;         // [S] node positions known to the boxes: never a margin away
  std::vector<Cell> cells_;           // parents before children, the first child right after its parent
  std::vector<Index> numbers_;        // [F] simplex at each place, in the order of the leaves
  std::vector<Index> nodes_;          // [F * corners] nodes of the simplex at each place
  std::vector<Index> leaf_;           // [F] cell of each place
  std::vector<Index> first_place_;    // [S + 1] begin of each node's entries in places_
  std::vector<Index> places_;         // [F * corners] places around each node, ascending
  std::vector<std::uint64_t> marks_;  // one bit per cell to be fitted
  std::size_t marks_end_ = 0;         // end of the words with marks
};

}  // namespace palpate
