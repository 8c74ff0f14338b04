#include "overlay/tangent_condensation.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Adds entries of K to the blocks of the condensation.
class Entries {
 public:
  Entries(const PatchLayers& layers, const Rows& shape, Eigen::Index dimension, LayeredStiffness& K,
          MatrixXd& K_GG)
      : layers_(layers), shape_(shape), d_(dimension), K_(K), K_GG_(K_GG) {}

  void add(Eigen::Index row, Eigen::Index column, double value) {
    for (Rows::InnerIterator left(shape_, row); left; ++left) {
      for (Rows::InnerIterator right(shape_, column); right; ++right)
        K_GG_(left.col(), right.col()) += left.value() * value * right.value();
    }
    const Index place = layers_.place_of(static_cast<std::size_t>(row));
    if (place < 0) return;
    const int layer = layer_of(row);
    const auto l = static_cast<std::size_t>(layer);
    for (Rows::InnerIterator right(shape_, column); right; ++right)
      K_.columns[l](place, right.col()) += value * right.value();
    const Index other = layers_.place_of(static_cast<std::size_t>(column));
    if (other < 0) return;
    if (layer_of(column) == layer) K_.diagonal[l](place, other) += value;
    if (layer_of(column) == layer - 1) K_.above[l](place, other) += value;
  }

 private:
  [[nodiscard]] int layer_of(Eigen::Index dof) const {
    return layers_.layer_of(static_cast<Index>(dof / d_));
  }

  const PatchLayers& layers_;
  const Rows& shape_;
  Eigen::Index d_;
  LayeredStiffness& K_;
  MatrixXd& K_GG_;
};

}  // namespace

TangentCondensation::TangentCondensation(const Model& model, const PatchMesh& patch)
    : patch_(patch),
      d_(model.dimension()),
      surface_(surface_nodes(patch)),
      layers_(patch, model.dimension(), surface_),
      shape_(shape_by_dofs(model, patch)) {}

bool TangentCondensation::set(const Eigen::SparseMatrix<double>& K, const VectorXd& f) {
  const Eigen::Index body_dofs = shape_.cols();
  K_.clear(layers_, body_dofs + 1);
  K_GG_ = MatrixXd::Zero(body_dofs, body_dofs);
  Entries entries(layers_, shape_, d_, K_, K_GG_);
  for (Eigen::Index column = 0; column < K.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(K, column); it; ++it) {
      entries.add(it.row(), column, it.value());
      if (it.row() != column) entries.add(column, it.row(), it.value());
    }
  }
  for (std::size_t dof = 0; dof < patch_.free_dof.size(); ++dof) {
    if (patch_.free_dof[dof] < 0) continue;
    const int layer = layers_.layer_of(static_cast<Index>(dof / static_cast<std::size_t>(d_)));
    K_.columns[static_cast<std::size_t>(layer)](layers_.place_of(dof), body_dofs) = f[patch_.free_dof[dof]];
  }
  MatrixXd G = MatrixXd::Zero(body_dofs + 1, body_dofs + 1);
  if (!eliminate(K_, G)) return false;
  G_ = G.topLeftCorner(body_dofs, body_dofs).selfadjointView<Eigen::Lower>();
  forces_on_body_ = G.row(body_dofs).head(body_dofs);
  return true;
}

VectorXd TangentCondensation::local_displacement(const VectorXd& u_Q) const {
  std::vector<VectorXd> u;  // by layers, from the surface down
  for (std::size_t k = 0; k < K_.diagonal.size(); ++k) {
    VectorXd at = K_.columns[k].rightCols(1) - K_.columns[k].leftCols(u_Q.size()) * u_Q;
    if (k > 0) at -= K_.above[k] * u[k - 1];
    K_.diagonal[k].triangularView<Eigen::Lower>().transpose().solveInPlace(at);
    u.push_back(std::move(at));
  }
  VectorXd result(patch_.free_dofs);
  for (std::size_t dof = 0; dof < patch_.free_dof.size(); ++dof) {
    if (patch_.free_dof[dof] < 0) continue;
    const int layer = layers_.layer_of(static_cast<Index>(dof / static_cast<std::size_t>(d_)));
    result[patch_.free_dof[dof]] = u[static_cast<std::size_t>(layer)][layers_.place_of(dof)];
  }
  return result;
}

CondensedPatch TangentCondensation::condensed(VectorXd& by_forces) const {
  CondensedPatch result{.surface = surface_, .G = G_, .T = {}, .compliance = {}};
  const SurfaceLayer surface = surface_layer(K_);
  put_surface(layers_, surface, shape_, d_, result);
  by_forces = VectorXd::Zero(result.T.rows());
  for (Eigen::Index dof = 0; dof < by_forces.size(); ++dof) {
    const Eigen::Index local = d_ * surface_[static_cast<std::size_t>(dof / d_)] + dof % d_;
    const Index place = layers_.place_of(static_cast<std::size_t>(local));
    if (place >= 0) by_forces[dof] = surface.columns(place, shape_.cols());
  }
  return result;
}

}  // namespace palpate
