#include "runtime/body/overlay.h"

#include <Eigen/Cholesky>
#include <string>
#include <utility>

#include "base/error.h"
#include "matrices/sparse_cholesky.h"
#include "meshes/element.h"
#include "runtime/body/make_patch.h"

namespace palpate {
namespace {

/// K of all local dofs [d local nodes].
Eigen::SparseMatrix<double> assemble_local(const Model& model, const PatchMesh& patch) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  std::vector<ElasticityMatrix> D;
  for (const Material& material : model.materials) D.push_back(elasticity_matrix(material, model.analysis));
  std::vector<Eigen::Triplet<double>> entries;
  for (Index e = 0; e < patch.local.elements(); ++e) {
    const auto parent = static_cast<std::size_t>(patch.parent[e]);
    const auto nodes = patch.local.element_nodes(e);
    const ElementMatrix K = element_stiffness(patch.local.element, element_nodes(patch.local, e),
                                              D[model.material_of_element[parent]], model.thickness);
    for (Eigen::Index i = 0; i < K.rows(); ++i) {
      for (Eigen::Index j = 0; j < K.cols(); ++j) {
        entries.emplace_back(d * nodes[i / d] + i % d, d * nodes[j / d] + j % d, K(i, j));
      }
    }
  }
  const Eigen::Index order = d * static_cast<Eigen::Index>(patch.local.nodes.size());
  Eigen::SparseMatrix<double> result(order, order);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

PatchStiffness assemble_patch(const Model& model, const PatchMesh& patch) {
  const Eigen::SparseMatrix<double> K = assemble_local(model, patch);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t dof = 0; dof < patch.free_dof.size(); ++dof) {
    if (patch.free_dof[dof] >= 0)
      entries.emplace_back(patch.free_dof[dof], static_cast<Eigen::Index>(dof), 1.0);
  }
  Eigen::SparseMatrix<double> pick(patch.free_dofs, K.rows());
  pick.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> rows = pick * K;
  return {.K_L = rows * Eigen::SparseMatrix<double>(pick.transpose()),
          .K_LG = Eigen::MatrixXd(rows * shape_by_dofs(model, patch))};
}

Overlay::Overlay(const Body& body, PatchMesh patch)
    : patch_(std::move(patch)), stored_(stored_nodes_of(body, patch_)) {
  const PatchStiffness stiffness = assemble_patch(body.model(), patch_);
  SparseCholesky factor;
  factor.analyse(stiffness.K_L);
  if (!factor.factorise(stiffness.K_L))
    throw Error("the stiffness of an overlay is not positive definite", body.model().name,
                "the elements there are too flat: mesh the body anew");
  recover_ = -factor.solve(stiffness.K_LG);
  const Eigen::MatrixXd G = -stiffness.K_LG.transpose() * recover_;
  M_ = overlay_correction(G, greens_at(body, stored_));
}

/// Xi at the patch's nodes for forces on a node [d g x d].
Eigen::MatrixXd Overlay::columns(const Body& body, Index node) const {
  const auto d = static_cast<Eigen::Index>(body.dimension());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(d, M_.rows());
  body.greens().gather(node, stored_, {rows.data(), static_cast<std::size_t>(rows.size())});
  return rows.transpose();
}

void Overlay::add_to_blocks(const Body& body, Index row, std::span<const Index> nodes,
                            std::span<double> blocks) const {
  const auto d = static_cast<Eigen::Index>(body.dimension());
  const Eigen::MatrixXd left = columns(body, row).transpose() * M_;
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> result(
      blocks.data(), d, d * static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t k = 0; k < nodes.size(); ++k)
    result.middleCols(d * static_cast<Eigen::Index>(k), d) += left * columns(body, nodes[k]);
}

Eigen::VectorXd Overlay::forces_beside(const Body& body, std::span<const Index> nodes,
                                       std::span<const double> f) const {
  const auto d = static_cast<Eigen::Index>(body.dimension());
  const Eigen::Map<const Eigen::VectorXd> forces(f.data(), static_cast<Eigen::Index>(f.size()));
  Eigen::VectorXd u_Q = Eigen::VectorXd::Zero(M_.rows());
  for (std::size_t k = 0; k < nodes.size(); ++k)
    u_Q += columns(body, nodes[k]) * forces.segment(d * static_cast<Eigen::Index>(k), d);
  return M_ * u_Q;
}

Eigen::MatrixXd Overlay::block(const Body& body, Index row, Index column) const {
  const auto d = static_cast<Eigen::Index>(body.dimension());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> result(d, d);
  const std::span<double> entries(result.data(), static_cast<std::size_t>(result.size()));
  body.greens().gather(row, {&column, 1}, entries);
  add_to_blocks(body, row, {&column, 1}, entries);
  return result;
}

}  // namespace palpate
