#include "runtime/body/make_patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>
#include <string>

#include "base/error.h"

namespace palpate {
using Eigen::MatrixXd;

std::vector<Index> surface_numbers(const Body& body, const PatchMesh& mesh,
                                   const std::vector<Index>& local_nodes) {
  std::vector<Index> number(mesh.local.nodes.size(), -1);
  const std::map<NodeKey, Index>& surface = body.fine_surface().number;
  const std::span<const Index> of_body = body.surface_mesh_nodes();
  for (const auto& [key, local] : mesh.node_of_key) {
    const auto found = surface.find(key);
    if (found != surface.end()) number[local] = found->second;
  }
  std::vector<Index> result;
  for (const Index local : local_nodes) {
    Index node = number[local];
    if (node < 0) {
      // At a mesh node, one shape function alone is not zero; held mesh nodes are not in Q.
      node = static_cast<Index>(std::lower_bound(of_body.begin(), of_body.end(), mesh.body_node[local]) -
                                of_body.begin());
    }
    result.push_back(node);
  }
  return result;
}

MatrixXd overlay_correction(const MatrixXd& G, const MatrixXd& greens) {
  const MatrixXd softened = MatrixXd::Identity(G.rows(), G.cols()) - G * greens;
  const MatrixXd M = softened.partialPivLu().solve(G);
  return 0.5 * (M + M.transpose());
}

MatrixXd greens_at(const Body& body, std::span<const Index> nodes) {
  const auto d = static_cast<Eigen::Index>(body.dimension());
  const Eigen::Index order = d * static_cast<Eigen::Index>(nodes.size());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> result(order, order);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    body.greens().gather(
        nodes[k], nodes,
        {result.data() + d * static_cast<Eigen::Index>(k) * order, static_cast<std::size_t>(d * order)});
  }
  return result;
}

std::vector<Index> stored_nodes_of(const Body& body, const PatchMesh& patch) {
  std::vector<Index> stored;
  for (const Index node : patch.nodes) {
    stored.push_back(body.stored_node(node));
    if (stored.back() >= 0) continue;
    throw Error(
        "an overlay reaches node " + std::to_string(node) + ", whose Green's functions are not stored",
        body.model().name, "precompute with scope = \"layers\" and as many layers as the overlay has rings");
  }
  return stored;
}

std::shared_ptr<const Patch> make_patch(const Body& body, const PatchMesh& mesh,
                                        const CondensedPatch& condensed, const PatchOffset& offset) {
  Patch::Parts parts;
  parts.elements = mesh.elements;
  parts.stored_nodes = stored_nodes_of(body, mesh);
  const auto d = static_cast<Eigen::Index>(body.dimension());
  const std::vector<Index> numbers = surface_numbers(body, mesh, condensed.surface);
  std::vector<std::size_t> order(numbers.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return numbers[a] < numbers[b]; });
  std::vector<Eigen::Index> dofs;
  for (const std::size_t k : order) {
    parts.surface_nodes.push_back(numbers[k]);
    for (Eigen::Index axis = 0; axis < d; ++axis) dofs.push_back(d * static_cast<Eigen::Index>(k) + axis);
  }

  const MatrixXd greens = greens_at(body, parts.stored_nodes);
  const MatrixXd M = overlay_correction(condensed.G, greens);
  const MatrixXd T = condensed.T(dofs, Eigen::all);
  MatrixXd with_overlay = greens * M;
  with_overlay.diagonal().array() += 1.0;
  const MatrixXd H = T * with_overlay;
  const MatrixXd by_body = H * greens;
  MatrixXd compliance = condensed.compliance(dofs, dofs);
  compliance.noalias() += by_body * T.transpose();
  parts.compliance = 0.5 * (compliance + compliance.transpose());
  parts.response = H;
  parts.correction = M;
  if (offset.forces.size() > 0) {
    const Eigen::VectorXd moved = greens * offset.forces;  // displacement of Q without the overlay
    parts.offset_forces = offset.forces + M * moved;
    parts.offset = H * moved + offset.surface(dofs);
  }
  return std::make_shared<const Patch>(std::move(parts));
}

std::size_t bytes_of(const CondensedPatch& condensed) noexcept {
  const auto entries =
      static_cast<std::size_t>(condensed.compliance.size() + condensed.T.size() + condensed.G.size());
  const auto dofs = static_cast<std::size_t>(condensed.T.rows() + condensed.T.cols());
  return sizeof(double) * entries + sizeof(Index) * dofs;  // one index per dof: an upper bound
}

}  // namespace palpate
