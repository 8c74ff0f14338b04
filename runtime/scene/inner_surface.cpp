#include "runtime/scene/inner_surface.h"

#include <algorithm>
#include <unordered_map>

#include "meshes/topology.h"

namespace palpate {

std::uint8_t material_number(const Model& model, Index element) {
  const Index material = model.material_of_element[static_cast<std::size_t>(element)];
  return static_cast<std::uint8_t>(std::min<Index>(material, 255));
}

InnerSurface make_inner_surface(const Model& model) {
  InnerSurface inner;
  std::unordered_map<Index, Index> places;
  const auto place_of = [&](Index node) {
    const auto [found, is_new] = places.try_emplace(node, static_cast<Index>(inner.nodes.size()));
    if (is_new) inner.nodes.push_back(model.mesh.nodes[static_cast<std::size_t>(node)]);
    return found->second;
  };
  const std::size_t corners = traits(traits(model.mesh.element).facet).corners;
  const std::vector<ElementSide> sides = sorted_sides(model.mesh);
  for (std::size_t k = 1; k < sides.size(); ++k) {
    if (sides[k].corners != sides[k - 1].corners) continue;
    const std::uint8_t one = material_number(model, sides[k - 1].element);
    const std::uint8_t other = material_number(model, sides[k].element);
    if (one == other) continue;
    const std::vector<Index> nodes = side_nodes(model.mesh, one > other ? sides[k - 1] : sides[k]);
    for (std::size_t corner = 2; corner < corners; ++corner) {
      inner.triangles.push_back({place_of(nodes[0]), place_of(nodes[corner - 1]), place_of(nodes[corner])});
      inner.inside.push_back(std::max(one, other));
      inner.outside.push_back(std::min(one, other));
    }
  }
  return inner;
}

}  // namespace palpate
