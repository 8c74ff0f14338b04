#include "runtime/body/overlay_rings.h"

#include <algorithm>
#include <vector>

#include "overlay/patch_mesh.h"

namespace palpate {

int overlay_rings(const Body& body) {
  const Model& model = body.model();
  if (model.mesh.element == ElementType::tet4a) return 0;
  const ElementsAtNodes at(model.mesh);
  const unsigned all_axes = (1U << model.dimension()) - 1U;
  std::vector<Index> centres;
  for (const Index stored : body.surface_stored_nodes()) {
    if (stored >= 0) centres.push_back(body.mesh_node(stored));
  }
  const auto is_known = [&](Index node) {
    return body.stored_node(node) >= 0 || (model.fixed[node] & all_axes) == all_axes;
  };
  int rings = 0;
  for (; rings < most_rings; ++rings) {
    const std::vector<Index> nodes = nodes_of(model.mesh, rings_round(model.mesh, at, centres, rings + 1));
    if (!std::all_of(nodes.begin(), nodes.end(), is_known)) break;
  }
  return rings;
}

}  // namespace palpate
