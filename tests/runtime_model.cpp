#include "tests/runtime_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "meshes/generate.h"
#include "meshes/surface.h"
#include "meshes/tet4.h"

namespace palpate::test {
namespace {

template <class T>
PackedGreens pack_as(const Eigen::MatrixXd& matrix, Precision precision) {
  auto packed = std::make_shared<std::vector<T>>();
  packed->reserve(static_cast<std::size_t>(packed_size(matrix.rows())));
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = j; i < matrix.rows(); ++i) packed->push_back(static_cast<T>(matrix(i, j)));
  }
  return {std::shared_ptr<const void>(packed, packed->data()), matrix.rows(), precision};
}

std::vector<Eigen::Index> dofs_of(const std::vector<Index>& nodes) {
  std::vector<Eigen::Index> dofs;
  for (const Index node : nodes) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) dofs.push_back(3 * Eigen::Index{node} + axis);
  }
  return dofs;
}

}  // namespace

Eigen::MatrixXd assemble_stiffness(const Mesh& mesh, const Material& material) {
  const auto order = static_cast<Eigen::Index>(3 * mesh.nodes.size());
  const Matrix6 D = elasticity_matrix(material);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(order, order);
  for (const Tet& tet : mesh.tets) {
    const std::vector<Eigen::Index> dofs = dofs_of({tet.begin(), tet.end()});
    K(dofs, dofs) += tet4::stiffness(tet4::corners(mesh, tet), D);
  }
  return K;
}

PackedGreens pack(const Eigen::MatrixXd& matrix, Precision precision) {
  return precision == Precision::single_precision ? pack_as<float>(matrix, precision)
                                                  : pack_as<double>(matrix, precision);
}

Eigen::MatrixXd random_definite(Eigen::Index order, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  Eigen::MatrixXd A(order, order);
  for (Eigen::Index j = 0; j < order; ++j) {
    for (Eigen::Index i = j; i < order; ++i) A(i, j) = A(j, i) = entry(random);
    A(j, j) = static_cast<double>(order) + entry(random);
  }
  return A;
}

Model box_model(int cells, Scope scope, Precision precision) {
  Model model;
  model.name = "box";
  model.mesh =
      generate(BoxShape{.origin = Vec3::Zero(), .size = Vec3::Ones(), .cells = {cells, cells, cells}});
  model.material = {.youngs_modulus = 1.0, .poissons_ratio = 0.3, .density = 1000.0};
  model.scope = scope;
  model.layers = 0;
  const Surface surface = extract_surface(model.mesh);
  model.surface_triangles = surface.triangles;

  std::vector<Index> free;
  for (Index node = 0; node < static_cast<Index>(model.mesh.nodes.size()); ++node) {
    const bool clamped = model.mesh.nodes[static_cast<std::size_t>(node)].z() < 1e-12;
    model.fixed.push_back(clamped ? 1 : 0);
    if (clamped) continue;
    free.push_back(node);
    if (scope == Scope::full || std::binary_search(surface.nodes.begin(), surface.nodes.end(), node)) {
      model.stored_nodes.push_back(node);
    }
  }
  std::shuffle(model.stored_nodes.begin(), model.stored_nodes.end(), std::mt19937(7));

  const std::vector<Eigen::Index> free_dofs = dofs_of(free);
  const Eigen::MatrixXd K = assemble_stiffness(model.mesh, model.material)(free_dofs, free_dofs);
  const Eigen::MatrixXd Xi = K.llt().solve(Eigen::MatrixXd::Identity(K.rows(), K.cols()));
  std::vector<Index> position(model.mesh.nodes.size(), -1);
  for (std::size_t k = 0; k < free.size(); ++k)
    position[static_cast<std::size_t>(free[k])] = static_cast<Index>(k);
  std::vector<Index> kept;
  for (const Index node : model.stored_nodes) kept.push_back(position[static_cast<std::size_t>(node)]);
  const std::vector<Eigen::Index> kept_dofs = dofs_of(kept);
  model.greens = pack(Xi(kept_dofs, kept_dofs), precision);
  return model;
}

}  // namespace palpate::test
