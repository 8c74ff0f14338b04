// Boundary of a baked model as a finger tip feels it: for comparing files, not for the tick.
#pragma once

#include <span>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Fraction of a force on each of some stored nodes; the rest to 1 is on fixed nodes, which do not move.
struct Tip {
  std::vector<Index> stored;
  std::vector<double> share;
};

class TouchedBoundary {
 public:
  explicit TouchedBoundary(const Model& model);

  /// Mesh nodes of the boundary that are free and stored, ascending.
  [[nodiscard]] const std::vector<Index>& free_nodes() const noexcept { return free_nodes_; }
  [[nodiscard]] Vec3 inward_normal(Index node) const noexcept {
    return -normals_[static_cast<std::size_t>(node)];
  }
  [[nodiscard]] double mean_edge() const noexcept { return mean_edge_; }

  /// Nodes under a tip of that radius with fractions of 1 - (r/R)^2 times their part of the boundary; the
  /// nearest node alone if no other is under it.
  [[nodiscard]] Tip tip(const Vec3& place, double radius) const;

  /// Mean displacement under the tip along `direction` by a unit force on it in that direction [m/N].
  [[nodiscard]] double compliance(const Tip& tip, const Vec3& direction) const;

  /// Position on the boundary.
  struct Place {
    std::size_t simplex;
    Vec3 weights;     // barycentric
    double distance;  // of the point from the boundary [m]
  };
  [[nodiscard]] Place nearest(const Vec3& point) const;

  /// Displacement at a place by a unit force on the tip along `direction` [m/N]; held nodes do not move.
  [[nodiscard]] Vec3 displacement(const Place& at, const Tip& tip, const Vec3& direction) const;

 private:
  [[nodiscard]] std::span<const Index> simplex(std::size_t s) const noexcept;
  [[nodiscard]] Vec3 node_displacement(Index stored, const Tip& tip, const Vec3& direction) const;

  const Model& model_;
  std::vector<Index> stored_of_node_;
  std::vector<Index> free_nodes_;
  std::vector<Vec3> normals_;  // [N] outward, of length 1; zero inside
  std::vector<double> areas_;  // [N] part of the boundary for each node [m^2], in the plane [m]
  double mean_edge_ = 0.0;
};

}  // namespace palpate
