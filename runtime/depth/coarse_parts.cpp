#include "runtime/depth/coarse_parts.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>
#include <vector>

#include "base/vectors.h"
#include "statics/polar.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double most_of_mesh = 0.8;  // dofs of a coarse body, of its mesh's

}  // namespace

CoarseParts make_coarse_parts(std::shared_ptr<const LiveBody> fine, std::span<const Index> stored_nodes,
                              Index most_dofs) {
  const Mesh& mesh = fine->mesh();
  const auto d = static_cast<std::size_t>(fine->dimension());
  std::vector<Vec3> free;
  std::vector<std::uint8_t> axes(mesh.nodes.size(), 0);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    for (std::size_t axis = 0; axis < d; ++axis)
      if (fine->free_of_dof()[d * node + axis] >= 0)
        axes[node] = static_cast<std::uint8_t>(axes[node] | 1U << axis);
    if (axes[node] != 0) free.push_back(mesh.nodes[node]);
  }
  // A field as fine as the mesh has slopes at the nodes that nodes do not decide.
  const Index most =
      std::min(most_dofs, static_cast<Index>(most_of_mesh * static_cast<double>(fine->free_dofs())));
  auto nodes = std::make_shared<CoarseNodes>(CoarseNodes{
      .field = coarse_field(fine->dimension(), free, most), .place = {}, .axes = {}, .compliance = {}});
  for (const Index node : stored_nodes) {
    nodes->place.push_back(nodes->field.place(mesh.nodes[static_cast<std::size_t>(node)]));
    nodes->axes.push_back(axes[static_cast<std::size_t>(node)]);
  }
  CoarseParts parts{.fine = std::move(fine), .body = nullptr, .nodes = nullptr, .K = {}};
  parts.body = std::make_unique<const CoarseBody>(*parts.fine, nodes->field);
  parts.K = parts.body->tangent(VectorXd::Zero(parts.body->dofs()));
  nodes->compliance = Eigen::LLT<MatrixXd>(parts.K).solve(MatrixXd::Identity(parts.K.rows(), parts.K.cols()));
  parts.nodes = std::move(nodes);
  return parts;
}

CoarseParts make_coarse_parts(const Model& model) {
  const bool is_strained =
      std::any_of(model.materials.begin(), model.materials.end(), [](const Material& material) {
        const auto& strain = material.initial_strain;
        return std::any_of(strain.begin(), strain.end(), [](double s) { return s != 0.0; });
      });
  const LiveOptions options{.law = is_strained ? LiveLaw::corotational : LiveLaw::neo_hookean};
  return make_coarse_parts(std::make_shared<const LiveBody>(live_input(model), options), model.stored_nodes,
                           most_coarse_dofs);
}

CoarseAt coarse_at(const CoarseNodes& nodes, Index node, std::span<const double> q) noexcept {
  CoarseAt at;
  const int d = nodes.field.dimension();
  const unsigned axes = nodes.axes[static_cast<std::size_t>(node)];
  const CoarseValue value = nodes.field.value(nodes.place[static_cast<std::size_t>(node)], q);
  at.F += value.gradient;
  at.moved = value.u;
  for (int axis = 0; axis < 3; ++axis)
    if (((axes >> axis) & 1U) == 0) at.moved[axis] = 0.0;
  if (nodes.turns(node)) at.R = d == 3 ? nearest_rotation(at.F) : nearest_rotation_in_plane(at.F);
  return at;
}

}  // namespace palpate
