#include "overlay/rounding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr double straight = 1e-6;  // [edge] offset of a middle node that does not count

using Edge = std::pair<Index, Index>;

Edge edge_of(Index a, Index b) {
  return std::minmax(a, b);
}

struct Facet {
  std::array<Index, 3> corners{};  // as many as the dimension
  Vec3 normal;
};

std::vector<Facet> facets_of(const Mesh& mesh) {
  const auto d = static_cast<std::size_t>(mesh.dimension());
  std::vector<Facet> facets;
  for (const ElementSide& side : boundary_sides(mesh)) {
    const std::vector<Index> nodes = side_nodes(mesh, side);
    Facet facet{};
    std::copy_n(nodes.begin(), d, facet.corners.begin());
    const Vec3 along = mesh.nodes[nodes[1]] - mesh.nodes[nodes[0]];
    facet.normal =
        d == 2 ? Vec3(along[1], -along[0], 0.0) : along.cross(mesh.nodes[nodes[2]] - mesh.nodes[nodes[0]]);
    facet.normal.normalize();
    facets.push_back(facet);
  }
  return facets;
}

/// Edges whose middle node is off the middle.
std::map<Edge, bool> curved_edges(const Mesh& mesh) {
  std::map<Edge, bool> curved;
  if (mesh.element != ElementType::tri6 && mesh.element != ElementType::tet10) return curved;
  const auto corners = static_cast<std::size_t>(traits(mesh.element).corners);
  for (const ElementSide& side : boundary_sides(mesh)) {
    const auto nodes = mesh.element_nodes(side.element);
    const std::span<const EdgeNodes> edges = element_edges(mesh.element);
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const Vec3 &a = mesh.nodes[nodes[edges[k][0]]], &b = mesh.nodes[nodes[edges[k][1]]];
      if ((mesh.nodes[nodes[corners + k]] - 0.5 * (a + b)).norm() > straight * (b - a).norm())
        curved[edge_of(nodes[edges[k][0]], nodes[edges[k][1]])] = true;
    }
  }
  return curved;
}

/// Mean normals at the corners of facets, over those that no crease parts there.
class CornerNormals {
 public:
  CornerNormals(const Mesh& mesh, const std::vector<Facet>& facets)
      : d_(static_cast<std::size_t>(mesh.dimension())), facets_(facets), root_(d_ * facets.size()) {
    std::iota(root_.begin(), root_.end(), std::size_t{0});
    std::map<std::vector<Index>, std::size_t> met;  // first facet at a ridge: an edge, in the plane a corner
    for (std::size_t f = 0; f < facets.size(); ++f) {
      for (std::size_t k = 0; k < d_; ++k) {
        std::vector<Index> ridge;
        for (std::size_t j = 0; j < d_; ++j) {
          if (j != k) ridge.push_back(facets[f].corners[j]);
        }
        std::sort(ridge.begin(), ridge.end());
        const auto [first, is_new] = met.emplace(ridge, f);
        if (!is_new && smooth(f, first->second)) {
          for (const Index corner : ridge) root_[find(place(f, corner))] = find(place(first->second, corner));
        }
      }
    }
    sum_.assign(root_.size(), Vec3::Zero());
    for (std::size_t f = 0; f < facets.size(); ++f) {
      for (std::size_t k = 0; k < d_; ++k) sum_[find(d_ * f + k)] += angle(mesh, f, k) * facets[f].normal;
    }
  }

  [[nodiscard]] bool smooth(std::size_t f, std::size_t g) const {
    return facets_[f].normal.dot(facets_[g].normal) > std::cos(Rounding::crease * std::numbers::pi / 180.0);
  }
  [[nodiscard]] Vec3 of(std::size_t f, Index corner) { return sum_[find(place(f, corner))].normalized(); }

 private:
  [[nodiscard]] std::size_t place(std::size_t f, Index corner) const {
    const auto& corners = facets_[f].corners;
    return d_ * f +
           static_cast<std::size_t>(std::find(corners.begin(), corners.end(), corner) - corners.begin());
  }
  std::size_t find(std::size_t k) {
    while (root_[k] != k) k = root_[k] = root_[root_[k]];
    return k;
  }
  [[nodiscard]] double angle(const Mesh& mesh, std::size_t f, std::size_t k) const {
    if (d_ == 2) return 1.0;
    const auto at = [&](std::size_t j) -> const Vec3& { return mesh.nodes[facets_[f].corners[j % 3]]; };
    return std::acos(
        std::clamp((at(k + 1) - at(k)).normalized().dot((at(k + 2) - at(k)).normalized()), -1.0, 1.0));
  }

  std::size_t d_;
  const std::vector<Facet>& facets_;
  std::vector<std::size_t> root_;  // of each facet's corner, by union and find
  std::vector<Vec3> sum_;
};

/// c of an arc from a to b = a + along that is perpendicular to the normals at both ends, as far as an arc
/// can be that bends to one side.
Vec3 bend(const Vec3& along, const Vec3& normal_a, const Vec3& normal_b) {
  const double rise = 0.5 * (normal_a - normal_b).dot(along);
  return rise / (1.0 + normal_a.dot(normal_b)) * (normal_a + normal_b);
}

}  // namespace

Rounding::Rounding(const Mesh& mesh) {
  if (traits(mesh.element).corners != mesh.dimension() + 1) return;
  const std::vector<Facet> facets = facets_of(mesh);
  const std::map<Edge, bool> curved = curved_edges(mesh);
  CornerNormals normals(mesh, facets);
  const auto d = static_cast<std::size_t>(mesh.dimension());
  std::map<Edge, std::size_t> met;  // first facet at an edge
  for (std::size_t f = 0; f < facets.size(); ++f) {
    for (std::size_t i = 0; i < d; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto [a, b] = edge_of(facets[f].corners[i], facets[f].corners[j]);
        const auto [first, is_new] = met.emplace(Edge(a, b), f);
        if (d == 3 && (is_new || !normals.smooth(f, first->second))) continue;
        if (curved.contains({a, b})) continue;
        bend_[{a, b}] = bend(mesh.nodes[b] - mesh.nodes[a], normals.of(f, a), normals.of(f, b));
      }
    }
  }
}

Vec3 Rounding::offset(std::span<const std::pair<Index, double>> weights) const {
  Vec3 offset = Vec3::Zero();
  for (std::size_t i = 0; i < weights.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto found = bend_.find(edge_of(weights[i].first, weights[j].first));
      if (found != bend_.end()) offset -= weights[i].second * weights[j].second * found->second;
    }
  }
  return offset;
}

}  // namespace palpate
