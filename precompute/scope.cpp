#include "precompute/scope.h"

#include <limits>

#include "meshes/surface.h"

namespace palpate {

std::vector<std::uint8_t> stored_dof_marks(const Mesh& mesh, const Stiffness& stiffness, Scope scope,
                                           Index layers) {
  const Index deepest = scope == Scope::full     ? std::numeric_limits<Index>::max()
                        : scope == Scope::layers ? layers
                                                 : 0;
  const std::vector<Index> layer = layers_below_surface(mesh, extract_surface(mesh));
  std::vector<std::uint8_t> marks;
  marks.reserve(3 * stiffness.free_nodes.size());
  for (const Index node : stiffness.free_nodes) {
    marks.insert(marks.end(), 3, layer[static_cast<std::size_t>(node)] <= deepest ? 1 : 0);
  }
  return marks;
}

}  // namespace palpate
