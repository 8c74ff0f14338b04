#include "overlay/condensation.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "base/error.h"
#include "meshes/element.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
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

}  // namespace

Condensation::Condensation(const Model& model, const PatchMesh& patch, CondensationMemory& memory)
    : patch_(patch),
      memory_(memory),
      d_(model.dimension()),
      surface_(surface_nodes(patch)),
      shape_(shape_by_dofs(model, patch)),
      unknown_(patch.free_dof.size(), -1) {
  std::vector<bool> is_on_surface(patch.local.nodes.size(), false);
  for (const Index node : surface_) is_on_surface[at(node)] = true;
  int next = 0;
  for (const bool surface : {false, true}) {
    if (surface) below_ = next;
    for (std::size_t dof = 0; dof < unknown_.size(); ++dof) {
      const bool is_free = patch.free_dof[dof] >= 0;
      if (is_free && is_on_surface[dof / static_cast<std::size_t>(d_)] == surface) unknown_[dof] = next++;
    }
  }
  on_surface_ = next - below_;
  clear();
}

void Condensation::clear() {
  memory_.entries.clear();
  bound_ = MatrixXd::Zero(shape_.cols(), shape_.cols());
}

void Condensation::add(Eigen::Index row, Eigen::Index column, double value) {
  const auto [of_least, of_most] =
      std::minmax(unknown_[static_cast<std::size_t>(row)], unknown_[static_cast<std::size_t>(column)]);
  const int least = of_least, most = of_most;
  if (least >= 0) {
    memory_.entries.emplace_back(most, least, value);
  } else if (most >= 0) {
    const Eigen::Index bound = unknown_[static_cast<std::size_t>(row)] < 0 ? row : column;
    for (Rows::InnerIterator by(shape_, bound); by; ++by)
      memory_.entries.emplace_back(below_ + on_surface_ + by.col(), most, value * by.value());
  } else {
    for (Rows::InnerIterator left(shape_, row); left; ++left) {
      for (Rows::InnerIterator right(shape_, column); right; ++right) {
        const double product = left.value() * value * right.value();
        bound_(left.col(), right.col()) += product;
        if (row != column) bound_(right.col(), left.col()) += product;
      }
    }
  }
}

bool Condensation::factorise(const VectorXd& f) {
  const Eigen::Index body = shape_.cols(), forces = below_ + on_surface_ + body;
  f_ = f;
  for (std::size_t dof = 0; dof < unknown_.size(); ++dof) {
    if (unknown_[dof] >= 0) memory_.entries.emplace_back(forces, unknown_[dof], f[patch_.free_dof[dof]]);
  }
  Eigen::SparseMatrix<double> A(forces + 1, forces + 1);
  A.setFromTriplets(memory_.entries.begin(), memory_.entries.end());
  if (!is_analysed_) memory_.factor.analyse(A, static_cast<int>(forces + 1 - below_));
  is_analysed_ = true;
  if (!memory_.factor.factorise(A)) return false;

  const auto S = memory_.factor.schur();
  factor_ = S.topLeftCorner(on_surface_, on_surface_);
  const Eigen::LLT<Eigen::Ref<MatrixXd>> in_place(factor_);
  if (in_place.info() != Eigen::Success || !(factor_.diagonal().array() > 0.0).all()) return false;
  columns_ = S.bottomLeftCorner(body + 1, on_surface_).transpose();
  factor_.triangularView<Eigen::Lower>().solveInPlace(columns_);
  const auto of_body = columns_.leftCols(body);
  stiffness_ = bound_ + MatrixXd(S.block(on_surface_, on_surface_, body, body));
  stiffness_.selfadjointView<Eigen::Lower>().rankUpdate(of_body.transpose(), -1.0);
  stiffness_.triangularView<Eigen::StrictlyUpper>() = stiffness_.transpose();
  forces_on_body_ =
      of_body.transpose() * columns_.col(body) - S.bottomRightCorner(1, body + 1).leftCols(body).transpose();
  for (std::size_t dof = 0; dof < unknown_.size(); ++dof) {
    if (unknown_[dof] < 0) continue;
    for (Rows::InnerIterator by(shape_, static_cast<Eigen::Index>(dof)); by; ++by)
      forces_on_body_[by.col()] += by.value() * f[patch_.free_dof[dof]];
  }
  return true;
}

VectorXd Condensation::local_displacement(const VectorXd& u_Q) const {
  const Eigen::Index body = shape_.cols();
  VectorXd kept(on_surface_ + body + 1);
  kept << columns_.col(body) - columns_.leftCols(body) * u_Q, u_Q, -1.0;
  auto surface = kept.head(on_surface_);
  factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(surface);
  const VectorXd below = memory_.factor.extended(kept), of_body = shape_ * u_Q;
  VectorXd result(patch_.free_dofs);
  for (std::size_t dof = 0; dof < unknown_.size(); ++dof) {
    const Eigen::Index unknown = unknown_[dof];
    if (unknown < 0) continue;
    result[patch_.free_dof[dof]] = (unknown < below_ ? below[unknown] : kept[unknown - below_]) -
                                   of_body[static_cast<Eigen::Index>(dof)];
  }
  return result;
}

/// Local dof of a dof on the surface.
Eigen::Index Condensation::surface_dof(Eigen::Index dof) const {
  return d_ * surface_[static_cast<std::size_t>(dof / d_)] + dof % d_;
}

CondensedPatch Condensation::condensed(const MatrixXd& K_P) const {
  const Eigen::Index dofs = d_ * std::ssize(surface_), body = shape_.cols();
  CondensedPatch result{.surface = surface_,
                        .G = K_P - stiffness_,
                        .T = MatrixXd::Zero(dofs, body),
                        .compliance = MatrixXd::Zero(dofs, dofs)};
  result.G.triangularView<Eigen::StrictlyUpper>() = result.G.transpose();  // to the last bit: files keep half
  MatrixXd inverse = MatrixXd::Identity(on_surface_, on_surface_);
  factor_.triangularView<Eigen::Lower>().solveInPlace(inverse);
  const MatrixXd by_body = inverse.transpose() * columns_.leftCols(body);
  MatrixXd compliance = MatrixXd::Zero(on_surface_, on_surface_);
  compliance.selfadjointView<Eigen::Lower>().rankUpdate(inverse.transpose());
  std::vector<Eigen::Index> place;  // free dofs of the surface in the result
  for (Eigen::Index dof = 0; dof < dofs; ++dof) {
    const Eigen::Index unknown = unknown_[static_cast<std::size_t>(surface_dof(dof))];
    if (unknown < 0) {
      result.T.row(dof) = shape_.row(surface_dof(dof));
      continue;
    }
    result.T.row(dof) = -by_body.row(unknown - below_);
    place.push_back(dof);
  }
  for (Eigen::Index j = 0; j < on_surface_; ++j) {
    for (Eigen::Index i = j; i < on_surface_; ++i) {
      const Eigen::Index row = place[static_cast<std::size_t>(i)],
                         column = place[static_cast<std::size_t>(j)];
      result.compliance(row, column) = result.compliance(column, row) = compliance(i, j);
    }
  }
  return result;
}

VectorXd Condensation::by_forces() const {
  VectorXd of_free = columns_.rightCols(1), result = VectorXd::Zero(d_ * std::ssize(surface_));
  factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(of_free);
  for (Eigen::Index dof = 0; dof < result.size(); ++dof) {
    const Eigen::Index unknown = unknown_[static_cast<std::size_t>(surface_dof(dof))];
    if (unknown >= 0) result[dof] = of_free[unknown - below_];
  }
  return result;
}

CondensedPatch condense(const Model& model, const PatchMesh& patch) {
  CondensationMemory memory;
  return condense(model, patch, memory);
}

CondensedPatch condense(const Model& model, const PatchMesh& patch, CondensationMemory& memory) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  Condensation condensation(model, patch, memory);
  ElementStiffness stiffness(model, patch);
  for (Index e = 0; e < patch.local.elements(); ++e) {
    const auto nodes = patch.local.element_nodes(e);
    const ElementMatrix& K_e = stiffness.of(e);
    const auto dof = [&](Eigen::Index i) { return d * nodes[static_cast<std::size_t>(i / d)] + i % d; };
    for (Eigen::Index j = 0; j < K_e.cols(); ++j) {
      for (Eigen::Index i = j; i < K_e.rows(); ++i) condensation.add(dof(i), dof(j), K_e(i, j));
    }
  }
  if (!condensation.factorise(VectorXd::Zero(patch.free_dofs))) {
    throw Error("the stiffness of an overlay is not positive definite", model.name,
                "the elements there are too flat: mesh the body anew");
  }
  return condensation.condensed(patch_stiffness(model, patch));
}

}  // namespace palpate
