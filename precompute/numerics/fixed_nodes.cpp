#include "precompute/numerics/fixed_nodes.h"

#include <fmt/format.h>

#include <array>

#include "base/error.h"

namespace palpate {
namespace {

bool holds(std::uint8_t axes, std::size_t axis) {
  return (axes >> axis & 1) != 0;
}

}  // namespace

FixedNodes hold_nodes(const Mesh& mesh, const std::vector<Fixing>& fixed, const std::string& file) {
  const std::size_t count = mesh.nodes.size();
  FixedNodes held{std::vector<std::uint8_t>(count, 0), std::vector<Vec3>(count, Vec3::Zero())};
  std::vector<std::array<std::size_t, 3>> holder(count);  // first entry that holds each dof

  for (std::size_t entry = 0; entry < fixed.size(); ++entry) {
    const std::string where = fmt::format("{}: [[fixed]] number {}", file, entry + 1);
    const std::vector<std::uint8_t> selected = select_nodes(mesh, fixed[entry].where, where);
    for (std::size_t node = 0; node < count; ++node) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (selected[node] == 0 || !holds(fixed[entry].axes, axis)) {
          continue;
        }
        const auto i = static_cast<Eigen::Index>(axis);
        const double u = fixed[entry].displacement[i];
        if (!holds(held.axes[node], axis)) {
          held.axes[node] = static_cast<std::uint8_t>(held.axes[node] | 1U << axis);
          held.displacement[node][i] = u;
          holder[node][axis] = entry;
        } else if (held.displacement[node][i] != u) {
          throw Error(fmt::format("node {} is held along {} at {} m, but at {} m by [[fixed]] number {}",
                                  node, "xyz"[axis], u, held.displacement[node][i], holder[node][axis] + 1),
                      where, "make the selections apart, or give the same displacement");
        }
      }
    }
  }
  return held;
}

}  // namespace palpate
