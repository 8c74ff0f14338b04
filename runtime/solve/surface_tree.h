// Finds the part of a moving surface that is near a tool.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "meshes/mesh.h"
#include "runtime/solve/nearest_point.h"

namespace palpate {

/// A simplex of the surface and the point of it that is nearest to something.
struct NearestSimplex {
  Index simplex = -1;
  NearestPoint nearest;
};

/// Bounding volume tree over the simplices of a surface whose nodes move. Boxes are a margin larger than what
/// they enclose, so that a node that moves less than that costs nothing, and those that move on cost the
/// paths from the leaves around them to the root, once where paths join: there is never a refit of the whole
/// tree, and boxes shrink as they grow. All memory is taken at construction; no call allocates.
class SurfaceTree {
 public:
  /// `simplices`: [F * corners] nodes of triangles (corners = 3) or lines (2); `positions`: [S] of the nodes
  /// [m]; `margin`: by how much boxes are larger than their simplices [m]. Throws Error when there is no
  /// simplex, or unless margin > 0.
  SurfaceTree(std::span<const Index> simplices, int corners, std::span<const Vec3> positions, double margin);

  /// Where the node was last moved to [m].
  [[nodiscard]] const Vec3& position(Index node) const noexcept { return positions_[node]; }

  /// Moves a node; `position` must be finite. The boxes follow in `refit`.
  void move(Index node, const Vec3& position) noexcept;

  /// Boxes of all that has moved. Call before asking what is where.
  void refit() noexcept;

  /// A box around the whole surface, at most two margins larger than it on each side [m].
  [[nodiscard]] Eigen::AlignedBox3d bounds() const noexcept {
    return {cells_.front().lower, cells_.front().upper};
  }

  /// All simplices whose own box (without margin) is within `reach` of the box of segment p q, which must be
  /// finite: fills `found` in an order that depends on nothing but the surface as it was at construction, and
  /// returns how many there are, which may be more than fit.
  [[nodiscard]] std::size_t near_segment(const Vec3& p, const Vec3& q, double reach,
                                         std::span<Index> found) const noexcept;

  /// The simplex whose present position is nearest to a point, which must be finite.
  [[nodiscard]] NearestSimplex nearest(const Vec3& point) const noexcept;

  /// Whether a point (in the plane with z = 0) is inside the surface, which must be closed: by the
  /// angle-weighted normal of the nearest vertex, edge or face (Baerentzen & Aanaes 2005). A point on the
  /// surface, to rounding, is not inside.
  [[nodiscard]] bool inside(const Vec3& point) const noexcept;

 private:
  /// Box of the simplices at places [first, first + count) of a leaf, or of two children: the cell that
  /// follows and the one at that one's end.
  struct Cell {
    Vec3 lower, upper;
    Index end;     // the cell after all descendants
    Index parent;  // -1: the root
    Index first;
    Index count;  // 0: not a leaf
  };

  void build(std::span<const Vec3> centres, Index first, Index last, Index parent);
  void connect_nodes();

  /// Sets the box of a cell by what it encloses; false if it was so before.
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
  std::vector<Vec3> anchors_;         // [S] where the boxes think that the nodes are: never a margin away
  std::vector<Cell> cells_;           // parents before children, first child next to its parent
  std::vector<Index> numbers_;        // [F] simplex at each place in the order of the leaves
  std::vector<Index> nodes_;          // [F * corners] of the simplex at each place
  std::vector<Index> leaf_;           // [F] cell of each place
  std::vector<Index> first_place_;    // [S + 1] of each node in places_
  std::vector<Index> places_;         // [F * corners] around each node, ascending
  std::vector<std::uint64_t> marks_;  // a bit for each cell that is to be fitted
  std::size_t marks_end_ = 0;         // no word of marks from here on has any
};

}  // namespace palpate
