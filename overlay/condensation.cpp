#include "overlay/condensation.h"

#include <algorithm>

#include "base/error.h"
#include "meshes/element.h"
#include "overlay/patch_layers.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

std::size_t at(Index i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Stiffness of the local elements. Parts of a linear simplex that are translates of each other have the
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

/// Adds an element's coupling of two local nodes to a block of K_L.
void add_local(const PatchLayers& layers, Index row_node, Index column_node, const auto& part,
               Eigen::Map<MatrixXd>& block) {
  const Eigen::Index d = part.rows();
  for (Eigen::Index j = 0; j < d; ++j) {
    const Index column = layers.place_of(static_cast<std::size_t>(d * column_node + j));
    for (Eigen::Index i = 0; column >= 0 && i < d; ++i) {
      const Index row = layers.place_of(static_cast<std::size_t>(d * row_node + i));
      if (row >= 0) block(row, column) += part(i, j);
    }
  }
}

/// Adds that coupling to K_GG, through the body's shape functions at both nodes.
void add_between_body(const Rows& shape, Index row_node, Index column_node, const auto& part,
                      MatrixXd& K_GG) {
  const Eigen::Index d = part.rows();
  for (Eigen::Index i = 0; i < d; ++i) {
    for (Rows::InnerIterator left(shape, d * row_node + i); left; ++left) {
      for (Eigen::Index j = 0; j < d; ++j) {
        for (Rows::InnerIterator right(shape, d * column_node + j); right; ++right)
          K_GG(left.col(), right.col()) += left.value() * part(i, j) * right.value();
      }
    }
  }
}

/// Adds that coupling to a block of K_LG, through the body's shape functions at the second node.
void add_to_body(const PatchLayers& layers, const Rows& shape, Index row_node, Index column_node,
                 const auto& part, Eigen::Map<MatrixXd>& block) {
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

void assemble(const Model& model, const PatchMesh& patch, const Rows& shape, const PatchLayers& layers,
              LayeredStiffness& K, MatrixXd& K_GG) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  ElementStiffness stiffness(model, patch);
  for (Index e = 0; e < patch.local.elements(); ++e) {
    const auto nodes = patch.local.element_nodes(e);
    const ElementMatrix& K_e = stiffness.of(e);
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const int layer = layers.layer_of(nodes[a]);
      const auto l = static_cast<std::size_t>(layer);
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        const auto part = K_e.block(d * static_cast<Eigen::Index>(a), d * static_cast<Eigen::Index>(b), d, d);
        if (!patch.is_nested) add_between_body(shape, nodes[a], nodes[b], part, K_GG);
        if (layer < 0) continue;
        const int other = layers.layer_of(nodes[b]);
        if (other == layer) add_local(layers, nodes[a], nodes[b], part, K.diagonal[l]);
        if (other >= 0 && other == layer - 1) add_local(layers, nodes[a], nodes[b], part, K.above[l]);
        add_to_body(layers, shape, nodes[a], nodes[b], part, K.columns[l]);
      }
    }
  }
}

}  // namespace

CondensedPatch condense(const Model& model, const PatchMesh& patch) {
  LayeredStiffness work;
  return condense(model, patch, work);
}

CondensedPatch condense(const Model& model, const PatchMesh& patch, LayeredStiffness& K) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  CondensedPatch result;
  result.surface = surface_nodes(patch);
  const PatchLayers layers(patch, model.dimension(), result.surface);
  const Rows shape = shape_by_dofs(model, patch);
  const Eigen::Index body_dofs = d * std::ssize(patch.nodes);
  K.clear(layers, body_dofs);
  MatrixXd K_GG = MatrixXd::Zero(body_dofs, body_dofs);
  assemble(model, patch, shape, layers, K, K_GG);
  result.G = MatrixXd::Zero(body_dofs, body_dofs);
  if (!eliminate(K, result.G)) {
    throw Error("the stiffness of an overlay is not positive definite", model.name,
                "the elements there are too flat: mesh the body anew");
  }
  result.G.triangularView<Eigen::StrictlyUpper>() = result.G.transpose();
  if (!patch.is_nested) result.G += patch_stiffness(model, patch) - K_GG;
  put_surface(layers, surface_layer(K), shape, d, result);
  return result;
}

}  // namespace palpate
