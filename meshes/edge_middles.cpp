#include "meshes/edge_middles.h"

#include <set>

#include "meshes/topology.h"

namespace palpate {

std::vector<Index> middles_between(const Mesh& mesh, const std::vector<Index>& listed) {
  const ElementTraits& kind = traits(mesh.element);
  if (kind.nodes == kind.corners) return {};
  const std::set<Index> ends(listed.begin(), listed.end());
  std::set<Index> middles;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const std::span<const Index> nodes = mesh.element_nodes(e);
    auto middle = nodes.begin() + kind.corners;
    for (const EdgeNodes& edge : element_edges(mesh.element)) {
      if (ends.contains(nodes[edge[0]]) && ends.contains(nodes[edge[1]]) && !ends.contains(*middle))
        middles.insert(*middle);
      ++middle;
    }
  }
  return {middles.begin(), middles.end()};
}

}  // namespace palpate
