#include "runtime/body/make_patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>

#include "base/error.h"

namespace palpate {
namespace {

constexpr double least_weight = 1e-12;  // that counts

}  // namespace

using Eigen::MatrixXd;

std::vector<Index> surface_numbers(const Body& body, const PatchMesh& mesh,
                                   const std::vector<Index>& local_nodes) {
  std::vector<Index> number(mesh.local.nodes.size(), -1);
  for (const auto& [key, local] : mesh.node_of_key) {
    const auto found = body.fine_surface().number.find(key);
    if (found != body.fine_surface().number.end()) number[local] = found->second;
  }
  std::vector<Index> result;
  result.reserve(local_nodes.size());
  for (const Index local : local_nodes) result.push_back(number[local]);
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

namespace {

/// Fills what a patch has of its nodes' compliance; `dofs` orders those of the condensed patch.
void put_compliance(const Body& body, const CondensedPatch& condensed, const std::vector<Eigen::Index>& dofs,
                    const PatchOffset& offset, Patch::Parts& parts) {
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
}

/// Calls visit(surface node, its weights of the corners) for those on a facet of the body's mesh.
void for_each_node_on(const Body& body, std::span<const Index> corners, int denominator, auto&& visit) {
  for (int i = 0; i <= denominator; ++i) {
    for (int j = 0; j <= denominator - i; ++j) {
      if (corners.size() == 2 && j != denominator - i) continue;
      const std::array<int, 3> weights = {i, j, denominator - i - j};
      NodeKey key;
      for (std::size_t k = 0; k < corners.size(); ++k) {
        if (weights[k] > 0) key.emplace_back(corners[k], weights[k]);
      }
      std::sort(key.begin(), key.end());
      visit(body.fine_surface().number.at(key), Vec3(weights[0], weights[1], weights[2]) / denominator);
    }
  }
}

/// Maps weights of a body's facet to those of a part of it.
Mat3 weights_of_part(const GradedFacet& part, std::size_t corners) {
  Mat3 of_part = Mat3::Identity();
  for (std::size_t k = 0; k < corners; ++k) of_part.col(static_cast<Eigen::Index>(k)) = part.weights[k];
  return of_part.inverse();
}

}  // namespace

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
  put_compliance(body, condensed, dofs, offset, parts);
  return std::make_shared<const Patch>(std::move(parts));
}

std::shared_ptr<const Patch> make_patch(const Body& body, const GradedMesh& mesh,
                                        const CondensedPatch& condensed) {
  const auto d = static_cast<std::size_t>(body.dimension());
  std::vector<Index> place(mesh.mesh.local.nodes.size(), -1);  // in the condensed surface
  for (std::size_t k = 0; k < condensed.surface.size(); ++k)
    place[condensed.surface[k]] = static_cast<Index>(k);

  struct Follower {
    double outside = std::numeric_limits<double>::infinity();  // by how much a weight is below 0
    std::vector<Patch::Part> parts;
  };
  std::map<Index, Follower> followers;  // of surface nodes
  const int denominator = body.fine_surface().denominator;
  for (const GradedFacet& facet : mesh.facets) {
    const Mat3 to_part = weights_of_part(facet, d);
    for_each_node_on(body, std::span(facet.corners).first(d), denominator, [&](Index node, const Vec3& at) {
      const Vec3 weights = to_part * at;
      const double outside = -weights.head(static_cast<Eigen::Index>(d)).minCoeff();
      Follower& follower = followers[node];
      if (outside >= follower.outside) return;
      follower = {outside, {}};
      const auto add = [&](std::size_t k, double weight) {
        if (std::abs(weight) > least_weight) follower.parts.push_back({place[facet.nodes[k]], weight});
      };
      for (std::size_t k = 0; k < d; ++k) {
        const double w = weights[static_cast<Eigen::Index>(k)],
                     next = weights[static_cast<Eigen::Index>((k + 1) % d)];
        add(k, w * (2.0 * w - 1.0));
        if (k < (d == 2 ? 1U : 3U)) add(d + k, 4.0 * w * next);
      }
    });
  }
  Patch::Parts parts;
  parts.elements = mesh.mesh.elements;
  parts.stored_nodes = stored_nodes_of(body, mesh.mesh);
  parts.first_part.push_back(0);
  for (const auto& [node, follower] : followers) {
    parts.surface_nodes.push_back(node);
    parts.follows.insert(parts.follows.end(), follower.parts.begin(), follower.parts.end());
    parts.first_part.push_back(static_cast<Index>(parts.follows.size()));
  }
  std::vector<Eigen::Index> dofs(static_cast<std::size_t>(condensed.T.rows()));
  std::iota(dofs.begin(), dofs.end(), Eigen::Index{0});
  put_compliance(body, condensed, dofs, {}, parts);
  return std::make_shared<const Patch>(std::move(parts));
}

std::size_t bytes_of(const CondensedPatch& condensed) noexcept {
  const auto entries =
      static_cast<std::size_t>(condensed.compliance.size() + condensed.T.size() + condensed.G.size());
  const auto dofs = static_cast<std::size_t>(condensed.T.rows() + condensed.T.cols());
  return sizeof(double) * entries + sizeof(Index) * dofs;  // one index per dof: an upper bound
}

}  // namespace palpate
