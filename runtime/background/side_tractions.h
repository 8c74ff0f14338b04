// Tractions on the sides of a surface from nodal forces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Smooth sides that meet at each node of a surface: adjacent facets belong to one side if their normals
/// differ by less than 30 degrees. A node has one place for each of its sides, with a traction each. The
/// first place of a node has the node's number; further ones are numbered after all nodes.
class SurfaceSides {
 public:
  /// `facet_nodes` [F x width] with unit normals [F]; lines in the plane, else triangles or quads, with or
  /// without mid-side nodes.
  SurfaceSides(std::size_t nodes, std::span<const Index> facet_nodes, std::span<const Vec3> facet_normals);

  [[nodiscard]] std::size_t places() const noexcept { return node_.size(); }
  [[nodiscard]] std::size_t width() const noexcept { return width_; }
  [[nodiscard]] std::span<const Index> facet_nodes() const noexcept { return facet_nodes_; }
  /// [F x width] place of each node of each facet.
  [[nodiscard]] std::span<const Index> places_of_facets() const noexcept { return place_; }
  [[nodiscard]] Index node(Index place) const noexcept { return node_[place]; }
  /// True if several sides meet at a node.
  [[nodiscard]] bool is_creased(Index node) const noexcept { return is_creased_[node] != 0; }
  /// Mean normal of the facets at a place, unit vector.
  [[nodiscard]] const Vec3& normal(Index place) const noexcept { return normal_[place]; }

 private:
  std::size_t width_;
  std::vector<Index> facet_nodes_;        // [F x width]
  std::vector<Index> place_;              // [F x width]
  std::vector<Index> node_;               // [places]
  std::vector<Vec3> normal_;              // [places]
  std::vector<std::uint8_t> is_creased_;  // [nodes]
};

/// Tractions of the sides as linear functions of nodal forces. Inside a side a node's force is distributed
/// over its area. At an edge one force belongs to several sides: each gets the mean traction of its adjacent
/// nodes, and the remaining force is distributed over all of them (or those without adjacent nodes), as
/// pressure rather than shear. Uniform tractions on each side are thus found exactly.
class SideTractions {
 public:
  /// `areas` [F x width]: contribution of each facet to the area of its nodes [m^2]; facets of area 0 do not
  /// take part. `sides` must outlive this.
  SideTractions(const SurfaceSides& sides, std::span<const double> areas);

  /// Traction at a place [N/m^2] by the forces on all nodes [N]; zero if the place has no area.
  [[nodiscard]] Vec3 at(Index place, std::span<const Vec3> force) const noexcept;

  /// Calls `visit(node, matrix)` for each node whose force affects the traction at a place: traction = sum of
  /// matrix * force.
  template <class Visit>
  void for_each(Index place, const Visit& visit) const {
    const auto at = static_cast<std::size_t>(place);
    if (!sides_->is_creased(sides_->node(place))) {
      visit(sides_->node(place), Mat3(inverse_area(place) * Mat3::Identity()));
      return;
    }
    for (auto k = static_cast<std::size_t>(first_[at]); k < static_cast<std::size_t>(first_[at + 1]); ++k)
      visit(by_[k], by_force_[k]);
  }

 private:
  [[nodiscard]] double inverse_area(Index place) const noexcept {
    const double area = area_[place];
    return area > 0.0 ? 1.0 / area : 0.0;
  }

  const SurfaceSides* sides_;
  std::vector<double> area_;    // [places]
  std::vector<Index> first_;    // [places + 1] in `by_`; empty except where sides meet
  std::vector<Index> by_;       // nodes of these forces
  std::vector<Mat3> by_force_;  // [1/m^2]
};

}  // namespace palpate
