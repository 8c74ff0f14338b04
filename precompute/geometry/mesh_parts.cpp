#include "precompute/geometry/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "meshes/check.h"
#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr double crumb = 0.01;  // of the largest part

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

/// For each element, the element that represents its part of the mesh, or of its region. [E]
std::vector<Index> find_parts(const Mesh& mesh, bool of_regions) {
  std::vector<Index> parent(at(mesh.elements()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index e) {
    while (parent[at(e)] != e) {
      e = parent[at(e)] = parent[at(parent[at(e)])];
    }
    return e;
  };
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  for (std::size_t s = 1; s < sides.size(); ++s) {
    const Index a = sides[s - 1].element, b = sides[s].element;
    if (sides[s - 1].corners == sides[s].corners &&
        (!of_regions || mesh.regions[at(a)] == mesh.regions[at(b)])) {
      parent[at(root(a))] = root(b);
    }
  }
  for (Index e = 0; e < mesh.elements(); ++e) {
    parent[at(e)] = root(e);
  }
  return parent;
}

}  // namespace

std::vector<RegionPoint> region_points(const Mesh& mesh) {
  const std::vector<Index> parts = find_parts(mesh, true);
  std::map<Index, std::pair<double, Index>> largest;  // for each part: volume and element
  for (Index e = 0; e < mesh.elements(); ++e) {
    auto& best = largest[parts[at(e)]];
    best = std::max(best, {std::abs(element_volume(mesh.element, element_nodes(mesh, e))), e});
  }
  std::vector<RegionPoint> points;
  for (const auto& [part, best] : largest) {
    const Vec3 middle = element_nodes(mesh, best.second).colwise().mean();
    points.push_back({middle, mesh.regions[at(best.second)]});
  }
  return points;
}

Index remove_crumbs(Mesh& mesh) {
  const std::vector<Index> parts = find_parts(mesh, false);
  std::vector<Index> size(parts.size(), 0);
  for (const Index part : parts) {
    ++size[at(part)];
  }
  const double limit = crumb * *std::max_element(size.begin(), size.end());
  std::vector<Index> connectivity, regions;
  for (Index e = 0; e < mesh.elements(); ++e) {
    if (size[at(parts[at(e)])] >= limit) {
      const auto nodes = mesh.element_nodes(e);
      connectivity.insert(connectivity.end(), nodes.begin(), nodes.end());
      regions.push_back(mesh.regions[at(e)]);
    }
  }
  const Index removed = mesh.elements() - static_cast<Index>(regions.size());
  mesh.connectivity = std::move(connectivity);
  mesh.regions = std::move(regions);
  remove_unused_nodes(mesh);
  return removed;
}

}  // namespace palpate
