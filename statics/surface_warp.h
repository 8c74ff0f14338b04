// Warped surface: each part rotated by its linear displacement's rotation.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "matrices/sparse_cholesky.h"
#include "meshes/mesh.h"

namespace palpate {

/// Surface to warp: S nodes, n / d of which have a displacement.
struct WarpSurface {
  int dimension = 3;               ///< d
  std::vector<Vec3> rest;          ///< [S] positions at rest [m]
  std::vector<Index> simplices;    ///< [F d] nodes of its triangles, in the plane of its lines, outward
  std::vector<Index> stored;       ///< [S] number in arrays [n], -1 for nodes held along every axis
  std::vector<std::uint8_t> held;  ///< [S] bit `axis` is set if the node is held along it

  [[nodiscard]] Index stored_nodes() const noexcept;  ///< n / d, the largest number plus one
};

/// Maps the linear displacement u of the surface's nodes to positions x(u), for which each simplex of the
/// surface rotates as u implies (docs/warp.md). A simplex s has the rotation vector
///
///   w_s = A_s u,
///
/// from the curl of u within it and the tilt of its normal: on a surface without shear tractions that is the
/// rotation of the body there. Its edges X_ab become t_ab = exp(w_s) (X_ab + u_a - u_b - w_s x X_ab), rotated
/// and with their small strain. All edges together determine the positions,
///
///   min_x sum_edges c_ab |x_a - x_b - t_ab|^2, held nodes where they rest,
///
/// a sparse system factorised once (c: half the cotangent of the opposite angle, in the plane 1 / length).
/// Rotations thus add up along the body: a tip goes where everything below it has rotated it. x(u) is u to
/// first order.
///
/// Const after construction: any number of threads may use it, each with a `Place` of its own.
class SurfaceWarp {
 public:
  /// Throws Error if a part of the surface has no held node along some axis.
  explicit SurfaceWarp(WarpSurface surface);

  /// Intermediate results between u and x, and memory for them.
  struct Place {
    explicit Place(const SurfaceWarp& warp);
    std::vector<Vec3> u;               ///< [S] linear displacement [m]
    std::vector<Vec3> w;               ///< [simplices] rotation vectors [rad]
    std::vector<Mat3> R;               ///< [simplices] exp(w)
    std::vector<Vec3> x;               ///< [S] x(u) [m]
    std::array<Eigen::VectorXd, 3> b;  ///< by axis [free nodes along it]: scratch
  };

  /// Fills `place` for u [n] of the stored nodes.
  void warp(std::span<const double> u, Place& place) const;
  /// x(u) minus the rest positions [n], for the stored nodes.
  void displacement(const Place& place, std::span<double> moved) const noexcept;
  /// g = J^T f [n] with J = dx / du at `place` (whose scratch it uses): the forces on the linear body that do
  /// the same work as forces f [n] on the stored nodes of the warped one.
  void pull_back(Place& place, std::span<const double> f, std::span<double> g) const;
  /// x' = J u' [n]: motion of the stored nodes for a change u' [n] of u at `place` (whose scratch it uses).
  void push_forward(Place& place, std::span<const double> du, std::span<double> dx) const;
  /// Rotations of the stored nodes: exp of the mean w of the simplices around each.
  void rotations(const Place& place, std::vector<Mat3>& R) const;

  [[nodiscard]] const WarpSurface& surface() const noexcept { return surface_; }

 private:
  struct Edge {
    Index a, b;  // surface nodes
    double c;    // weight
    Vec3 X;      // from b to a at rest [m]
  };
  /// Nodes, edges, and h_k and N of w = sum_k N (h_k . u_k) / 2 - h_k (N . u_k).
  struct Simplex {
    std::array<Index, 3> nodes;
    std::array<Vec3, 3> h;
    Vec3 N;
    double size;  // area, in the plane length [m^2, m]
    std::array<Edge, 3> edges;
  };

  void add_triangle(const std::array<Index, 3>& nodes);
  void add_line(Index a, Index b);
  void number_free_nodes();
  void check_held() const;
  void factor();
  void solve(std::array<Eigen::VectorXd, 3>& b, std::vector<Vec3>& x) const;
  /// Adds an edge's part of the right-hand sides, with t as its target. `held` [S]: positions of nodes that
  /// cannot move.
  void join(const Edge& edge, const Vec3& t, std::span<const Vec3> held, Place& place) const;
  [[nodiscard]] Vec3 rotation(const Simplex& simplex, const std::vector<Vec3>& u) const noexcept;

  WarpSurface surface_;
  int dimension_;
  std::vector<Simplex> simplices_;
  std::array<std::vector<Index>, 3>
      free_;  // [S] by axis: number among those that can move along it, -1: held
  std::array<Index, 3> free_count_{};
  std::array<SparseCholesky, 3> factor_;
};

}  // namespace palpate
