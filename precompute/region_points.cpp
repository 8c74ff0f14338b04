#include "precompute/region_points.h"

#include <map>
#include <numeric>

#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

/// For each element, one that stands for its part. [E]
std::vector<Index> find_parts(const Mesh& mesh) {
  std::vector<Index> parent(static_cast<std::size_t>(mesh.elements()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index e) {
    while (parent[static_cast<std::size_t>(e)] != e) {
      Index& up = parent[static_cast<std::size_t>(e)];
      e = up = parent[static_cast<std::size_t>(up)];
    }
    return e;
  };
  const auto region = [&](Index e) { return mesh.regions[static_cast<std::size_t>(e)]; };
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  for (std::size_t s = 1; s < sides.size(); ++s) {
    const Index a = sides[s - 1].element, b = sides[s].element;
    if (sides[s - 1].corners == sides[s].corners && region(a) == region(b)) {
      parent[static_cast<std::size_t>(root(a))] = root(b);
    }
  }
  for (Index e = 0; e < mesh.elements(); ++e) {
    parent[static_cast<std::size_t>(e)] = root(e);
  }
  return parent;
}

}  // namespace

std::vector<RegionPoint> region_points(const Mesh& mesh) {
  const std::vector<Index> parts = find_parts(mesh);
  std::map<Index, std::pair<double, Index>> largest;  // of each part: volume and element
  for (Index e = 0; e < mesh.elements(); ++e) {
    const double volume = std::abs(element_volume(mesh.element, element_nodes(mesh, e)));
    auto& best = largest[parts[static_cast<std::size_t>(e)]];
    best = std::max(best, {volume, e});
  }
  std::vector<RegionPoint> points;
  for (const auto& [part, best] : largest) {
    const Vec3 middle = element_nodes(mesh, best.second).colwise().mean();
    points.push_back({middle, mesh.regions[static_cast<std::size_t>(best.second)]});
  }
  return points;
}

}  // namespace palpate
