#include "precompute/warping/loaded_part.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "meshes/surface.h"

namespace palpate {
namespace {

constexpr double end_share = 0.95;  // of the largest distance from held nodes
constexpr double alike = 0.99;      // of the largest softness
constexpr double same = 1e-6;       // of a softness: rounding and the mesh do not choose between axes

/// Surface nodes that can move along every axis, ascending.
std::vector<Index> free_surface_nodes(const Model& model) {
  std::vector<Index> nodes = number_surface(model.surface, model.mesh.nodes.size()).mesh_nodes;
  std::erase_if(nodes, [&](Index node) { return model.fixed[static_cast<std::size_t>(node)] != 0; });
  return nodes;
}

/// The nodes among them that are farthest from held ones.
std::vector<Index> free_end(const Model& model, const std::vector<Index>& nodes) {
  std::vector<Vec3> held;
  for (std::size_t node = 0; node < model.fixed.size(); ++node) {
    if (model.fixed[node] != 0) held.push_back(model.mesh.nodes[node]);
  }
  std::vector<double> distance;
  for (const Index node : nodes) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& at : held)
      nearest = std::min(nearest, (model.mesh.nodes[static_cast<std::size_t>(node)] - at).squaredNorm());
    distance.push_back(std::sqrt(nearest));
  }
  const double least = end_share * *std::max_element(distance.begin(), distance.end());
  std::vector<Index> end;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (distance[k] >= least) end.push_back(nodes[k]);
  }
  return end;
}

}  // namespace

std::vector<Index> loaded_nodes(const Model& model, const std::optional<Selection>& where,
                                const std::string& place) {
  std::vector<Index> nodes = free_surface_nodes(model);
  if (nodes.empty())
    throw Error("no node of the surface is free along every axis", place, "hold less of the body");
  if (!where) return free_end(model, nodes);
  const std::vector<std::uint8_t> selected = select_nodes(model.mesh, *where, place);
  std::erase_if(nodes, [&](Index node) { return selected[static_cast<std::size_t>(node)] == 0; });
  if (nodes.empty()) {
    throw Error("[warp] selects no node of the surface that is free along every axis", place,
                "select another part, or none for the end that is farthest from what is held");
  }
  return nodes;
}

Vec3 softest_direction(const Mat3& softness, int dimension) {
  const Eigen::Index d = dimension;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(softness.topLeftCorner(d, d));
  Eigen::Index axis = 0;
  for (Eigen::Index k = 1; k < d; ++k) {
    if (softness(k, k) >= (1.0 - same) * softness(axis, axis)) axis = k;
  }
  Vec3 direction = Vec3::Zero();
  for (Eigen::Index k = 0; k < d; ++k) {
    if (parts.eigenvalues()[k] < alike * parts.eigenvalues()[d - 1]) continue;
    direction.head(d) += parts.eigenvectors()(axis, k) * parts.eigenvectors().col(k);
  }
  return direction.normalized();
}

}  // namespace palpate
