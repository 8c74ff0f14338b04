#include "overlay/condensation.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "base/error.h"
#include "meshes/element.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

std::size_t at(Index i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Free local nodes by their distance from the surface, in elements.
class Layers {
 public:
  Layers(const PatchMesh& patch, int dimension, const std::vector<Index>& surface)
      : layer_of_(patch.local.nodes.size(), unreached), first_dof_(patch.free_dof.size(), -1) {
    const auto d = static_cast<std::size_t>(dimension);
    const auto is_free = [&](Index node) {
      const auto first = patch.free_dof.begin() + static_cast<std::ptrdiff_t>(d * at(node));
      return std::any_of(first, first + dimension, [](Index dof) { return dof >= 0; });
    };
    for (std::size_t node = 0; node < layer_of_.size(); ++node) {
      if (!is_free(static_cast<Index>(node))) layer_of_[node] = none;
    }
    std::vector<Index> reached;
    for (const Index node : surface) {
      if (layer_of_[at(node)] == unreached) reached.push_back(node);
    }
    if (reached.empty()) sizes_.push_back(0);
    while (!reached.empty()) {
      add_layer(reached, patch, d);
      reached = next_to(patch);
    }
    for (std::size_t node = 0; node < layer_of_.size(); ++node) {  // those that no surface is near
      if (layer_of_[node] == unreached) reached.push_back(static_cast<Index>(node));
    }
    if (!reached.empty()) add_layer(reached, patch, d);
  }

  [[nodiscard]] int count() const { return static_cast<int>(sizes_.size()); }
  [[nodiscard]] Eigen::Index size(int layer) const { return sizes_[layer]; }
  [[nodiscard]] int layer_of(Index node) const { return layer_of_[at(node)]; }  ///< < 0: none
  /// Place of a local dof in its layer, -1 when it is not free.
  [[nodiscard]] Index place_of(std::size_t dof) const { return first_dof_[dof]; }

 private:
  static constexpr int none = -1, unreached = -2;

  void add_layer(const std::vector<Index>& nodes, const PatchMesh& patch, std::size_t d) {
    Index size = 0;
    for (const Index node : nodes) {
      layer_of_[at(node)] = count();
      for (std::size_t dof = d * at(node); dof < d * (at(node) + 1); ++dof) {
        if (patch.free_dof[dof] >= 0) first_dof_[dof] = size++;
      }
    }
    sizes_.push_back(size);
  }

  /// Nodes that have an element in common with the last layer.
  std::vector<Index> next_to(const PatchMesh& patch) const {
    std::vector<Index> found;
    for (Index e = 0; e < patch.local.elements(); ++e) {
      const auto nodes = patch.local.element_nodes(e);
      const auto is_last = [&](Index node) { return layer_of_[at(node)] == count() - 1; };
      if (std::none_of(nodes.begin(), nodes.end(), is_last)) continue;
      std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(found),
                   [&](Index node) { return layer_of_[at(node)] == unreached; });
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  std::vector<int> layer_of_;
  std::vector<Index> first_dof_;
  std::vector<Eigen::Index> sizes_;
};

/// Stiffness of the local elements. Parts of a linear simplex that are one the other's translate have the
/// same.
class ElementStiffness {
 public:
  ElementStiffness(const Model& model, const PatchMesh& patch) : model_(model), patch_(patch) {
    for (const Material& material : model.materials)
      D_.push_back(elasticity_matrix(material, model.analysis));
  }

  const ElementMatrix& of(Index e) {
    const ElementType type = patch_.local.element;
    const ElementNodes x = element_nodes(patch_.local, e);
    const Index parent = patch_.parent[at(e)];
    if ((type == ElementType::tri3 || type == ElementType::tet4) && parent == last_parent_) {
      const ElementNodes moved = last_x_.rowwise() + (x.row(0) - last_x_.row(0));
      if ((moved - x).cwiseAbs().maxCoeff() < same_shape * (x.row(1) - x.row(0)).norm()) return K_;
    }
    last_parent_ = parent;
    last_x_ = x;
    K_ = element_stiffness(type, x, D_[at(model_.material_of_element[at(parent)])], model_.thickness);
    return K_;
  }

 private:
  static constexpr double same_shape = 1e-12;

  const Model& model_;
  const PatchMesh& patch_;
  std::vector<ElasticityMatrix> D_;
  Index last_parent_ = -1;
  ElementNodes last_x_;
  ElementMatrix K_;
};

/// K_L and K_LG by layers: K_L is block tridiagonal.
struct LayeredStiffness {
  std::vector<MatrixXd> diagonal;  // [n_k x n_k] lower triangle
  std::vector<MatrixXd> above;     // [n_k x n_(k-1)] to the layer before
  std::vector<MatrixXd> to_body;   // [n_k x d g]
};

/// Adds to a block of K_L what an element couples two local nodes by.
void add_local(const Layers& layers, Index row_node, Index column_node, const auto& part, MatrixXd& block) {
  const Eigen::Index d = part.rows();
  for (Eigen::Index j = 0; j < d; ++j) {
    const Index column = layers.place_of(static_cast<std::size_t>(d * column_node + j));
    for (Eigen::Index i = 0; column >= 0 && i < d; ++i) {
      const Index row = layers.place_of(static_cast<std::size_t>(d * row_node + i));
      if (row >= 0) block(row, column) += part(i, j);
    }
  }
}

/// Adds the same to a block of K_LG, through the body's shape functions at the second node.
void add_to_body(const Layers& layers, const Rows& shape, Index row_node, Index column_node, const auto& part,
                 MatrixXd& block) {
  const Eigen::Index d = part.rows();
  for (Eigen::Index j = 0; j < d; ++j) {
    for (Rows::InnerIterator it(shape, d * column_node + j); it; ++it) {
      for (Eigen::Index i = 0; i < d; ++i) {
        const Index row = layers.place_of(static_cast<std::size_t>(d * row_node + i));
        if (row >= 0) block(row, it.col()) += it.value() * part(i, j);
      }
    }
  }
}

LayeredStiffness assemble(const Model& model, const PatchMesh& patch, const Rows& shape,
                          const Layers& layers) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  const Eigen::Index body_dofs = d * static_cast<Eigen::Index>(patch.nodes.size());
  LayeredStiffness K;
  for (int k = 0; k < layers.count(); ++k) {
    K.diagonal.push_back(MatrixXd::Zero(layers.size(k), layers.size(k)));
    K.above.push_back(MatrixXd::Zero(layers.size(k), k > 0 ? layers.size(k - 1) : 0));
    K.to_body.push_back(MatrixXd::Zero(layers.size(k), body_dofs));
  }
  ElementStiffness stiffness(model, patch);
  for (Index e = 0; e < patch.local.elements(); ++e) {
    const auto nodes = patch.local.element_nodes(e);
    const ElementMatrix& K_e = stiffness.of(e);
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const int layer = layers.layer_of(nodes[a]);
      if (layer < 0) continue;
      const auto l = static_cast<std::size_t>(layer);
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        const auto part = K_e.block(d * static_cast<Eigen::Index>(a), d * static_cast<Eigen::Index>(b), d, d);
        const int other = layers.layer_of(nodes[b]);
        if (other == layer) add_local(layers, nodes[a], nodes[b], part, K.diagonal[l]);
        if (other >= 0 && other == layer - 1) add_local(layers, nodes[a], nodes[b], part, K.above[l]);
        add_to_body(layers, shape, nodes[a], nodes[b], part, K.to_body[l]);
      }
    }
  }
  return K;
}

}  // namespace

CondensedPatch condense(const Model& model, const PatchMesh& patch) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  CondensedPatch result;
  result.surface = surface_nodes(patch);
  const Layers layers(patch, model.dimension(), result.surface);
  const Rows shape = shape_by_dofs(model, patch);
  LayeredStiffness K = assemble(model, patch, shape, layers);
  const Eigen::Index body_dofs = d * std::ssize(patch.nodes);
  result.G = MatrixXd::Zero(body_dofs, body_dofs);
  for (int k = layers.count() - 1; k >= 0; --k) {
    const auto l = static_cast<std::size_t>(k);
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(K.diagonal[l]);
    if (factor.info() != Eigen::Success)
      throw Error("the stiffness of an overlay is not positive definite", model.name,
                  "the elements there are too flat: mesh the body anew");
    const auto L = factor.matrixL();
    L.solveInPlace(K.to_body[l]);
    result.G.selfadjointView<Eigen::Lower>().rankUpdate(K.to_body[l].transpose());
    if (k == 0) break;
    L.solveInPlace(K.above[l]);
    K.diagonal[l - 1].selfadjointView<Eigen::Lower>().rankUpdate(K.above[l].transpose(), -1.0);
    K.to_body[l - 1].noalias() -= K.above[l].transpose() * K.to_body[l];
  }
  result.G.triangularView<Eigen::StrictlyUpper>() = result.G.transpose();

  // The surface's layer is left with K_L's Schur complement on it, whose inverse is the block of K_L^-1.
  const auto L = K.diagonal[0].triangularView<Eigen::Lower>();
  MatrixXd inverse = MatrixXd::Identity(layers.size(0), layers.size(0));
  L.solveInPlace(inverse);
  const MatrixXd u_L = inverse.transpose() * K.to_body[0];
  MatrixXd compliance = MatrixXd::Zero(layers.size(0), layers.size(0));
  compliance.selfadjointView<Eigen::Lower>().rankUpdate(inverse.transpose());
  compliance.triangularView<Eigen::StrictlyUpper>() = compliance.transpose();

  result.T = MatrixXd::Zero(d * std::ssize(result.surface), body_dofs);
  result.compliance = MatrixXd::Zero(result.T.rows(), result.T.rows());
  std::vector<Eigen::Index> place(static_cast<std::size_t>(result.T.rows()));
  for (std::size_t dof = 0; dof < place.size(); ++dof) {
    const auto width = static_cast<std::size_t>(d);
    const std::size_t local = width * at(result.surface[dof / width]) + dof % width;
    place[dof] = layers.place_of(local);
    result.T.row(static_cast<Eigen::Index>(dof)) = shape.row(static_cast<Eigen::Index>(local));
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] < 0) continue;
    const auto row = static_cast<Eigen::Index>(i);
    result.T.row(row) -= u_L.row(place[i]);
    for (std::size_t j = 0; j < place.size(); ++j) {
      if (place[j] >= 0)
        result.compliance(static_cast<Eigen::Index>(j), row) = compliance(place[j], place[i]);
    }
  }
  return result;
}

}  // namespace palpate
