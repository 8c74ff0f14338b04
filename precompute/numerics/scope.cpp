#include "precompute/numerics/scope.h"

#include <algorithm>
#include <limits>

namespace palpate {

std::vector<std::uint8_t> stored_dof_marks(const Mesh& mesh, const Surface& surface,
                                           const Stiffness& stiffness, Scope scope, Index layers) {
  const Index deepest = scope == Scope::full     ? std::numeric_limits<Index>::max()
                        : scope == Scope::layers ? layers
                                                 : 0;
  const std::vector<Index> layer = layers_below_surface(mesh, surface);
  const int d = mesh.dimension();
  std::vector<std::uint8_t> marks(stiffness.free_dofs.size(), 0);
  for (std::size_t a = 0; a + 1 < stiffness.node_start.size(); ++a) {
    const std::int64_t first = stiffness.node_start[a], end = stiffness.node_start[a + 1];
    const std::int64_t node = stiffness.free_dofs[static_cast<std::size_t>(first)] / d;
    const bool kept = layer[static_cast<std::size_t>(node)] <= deepest;
    std::fill(marks.begin() + first, marks.begin() + end, kept ? 1 : 0);
  }
  return marks;
}

}  // namespace palpate
