#include "statics/springs.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "base/error.h"
#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {

std::vector<Spring> fitted_springs(const Mesh& mesh, std::span<const Material> materials,
                                   std::span<const Index> material_of_element, double thickness) {
  if (mesh.element != ElementType::tri3 && mesh.element != ElementType::tet4) {
    throw Error(std::string("springs stand for edges of tri3 and tet4, and the body has ") +
                    traits(mesh.element).name,
                "solver mass-spring", "mesh the body with tet4 or tri3, or take the corotational solver");
  }
  std::map<std::pair<Index, Index>, double> stiffness;  // times L^2
  for (Index e = 0; e < mesh.elements(); ++e) {
    const double volume = element_volume(mesh.element, element_nodes(mesh, e)) * thickness,
                 E = materials[material_of_element[e]].youngs_modulus;
    const std::span<const Index> nodes = mesh.element_nodes(e);
    for (const EdgeNodes& edge : element_edges(mesh.element)) {
      const auto [a, b] = std::minmax(nodes[edge[0]], nodes[edge[1]]);
      stiffness[{a, b}] += E * volume;
    }
  }
  std::vector<Spring> springs;
  for (const auto& [nodes, times_square] : stiffness) {
    const double length = (mesh.nodes[nodes.second] - mesh.nodes[nodes.first]).norm();
    springs.push_back({nodes.first, nodes.second, times_square / (length * length), length});
  }
  return springs;
}

}  // namespace palpate
