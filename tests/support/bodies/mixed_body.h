// A body with a finer patch, each by a law of its own, solved as one sparse system: a second route beside
// Green's functions and condensation.
#pragma once

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "overlay/patch_mesh.h"
#include "statics/live_forces.h"

namespace palpate::test {

/// Unknowns q: the free dofs of the body's nodes, then those of the fine mesh beside them. Displacements are
/// on top of the rest under the model's loads, where all is in balance.
class MixedBody {
 public:
  using Sparse = Eigen::SparseMatrix<double>;

  MixedBody(const Model& model, const PatchMesh& patch, LiveLaw outside, LiveLaw inside)
      : d_(model.dimension()),
        parts_{Part{.body = LiveBody(outside_of(model, patch), {.law = outside})},
               Part{.body = LiveBody(inside_of(model, patch), {.law = inside})}} {
    const std::vector<Eigen::Index> dof = number(model, patch);
    std::vector<Eigen::Triplet<double>> out, in;
    for (std::size_t k = 0; k < dof.size(); ++k) {
      if (dof[k] >= 0) out.emplace_back(static_cast<Eigen::Index>(k), dof[k], 1.0);
    }
    for (Eigen::Index node = 0; node < patch.shape.outerSize(); ++node) {
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(patch.shape, node); it; ++it) {
        for (Eigen::Index axis = 0; axis < d_; ++axis) {
          const Eigen::Index to = dof[static_cast<std::size_t>(d_ * patch.nodes[it.col()] + axis)];
          if (to >= 0) in.emplace_back(d_ * node + axis, to, it.value());
        }
      }
    }
    for (std::size_t k = 0; k < patch.free_dof.size(); ++k) {
      if (patch.free_dof[k] >= 0)
        in.emplace_back(static_cast<Eigen::Index>(k), body_dofs_ + patch.free_dof[k], 1.0);
    }
    const Eigen::Index dofs = body_dofs_ + patch.free_dofs;
    begin(parts_[0], out, dofs, model.rest_displacement);
    begin(parts_[1], in, dofs, patch.rest_displacement);
  }

  [[nodiscard]] Eigen::Index dofs() const { return parts_[0].Z.cols(); }
  /// [d N x q] and [d local nodes x q]: the displacement of all nodes.
  [[nodiscard]] const Sparse& of_body() const { return parts_[0].Z; }
  [[nodiscard]] const Sparse& of_patch() const { return parts_[1].Z; }

  /// Newton's method from q to where forces [q] balance under A q = b, with the multipliers. False when it is
  /// not found.
  [[nodiscard]] bool find(const Eigen::VectorXd& force, const Sparse& A, const Eigen::VectorXd& b,
                          Eigen::VectorXd& q, Eigen::VectorXd& multipliers) {
    multipliers = Eigen::VectorXd::Zero(A.rows());
    double largest = force.norm();
    for (int step = 0; step < 100; ++step) {
      Eigen::VectorXd internal;
      double energy = look(q, internal) - force.dot(q);
      largest = std::max(largest, internal.norm());
      const Eigen::VectorXd left = force - internal - A.transpose() * multipliers, apart = b - A * q;
      if (left.norm() <= 1e-11 * largest && apart.norm() <= 1e-12 * std::max(b.norm(), q.norm())) return true;
      Eigen::VectorXd right(dofs() + A.rows());
      right << Eigen::VectorXd(force - internal), apart;
      Eigen::SparseLU<Sparse> factor(tangent(q, A));
      if (factor.info() != Eigen::Success) return false;
      const Eigen::VectorXd change = factor.solve(right);
      const Eigen::VectorXd dq = change.head(dofs());
      double share = 1.0;
      // Shortened until the energy falls, where nothing is still to be moved to its place.
      for (int cut = 0; cut < 30 && apart.norm() <= 1e-12 * std::max(b.norm(), q.norm());
           ++cut, share *= 0.5) {
        Eigen::VectorXd there;
        const double after = look(q + share * dq, there) - force.dot(q + share * dq);
        if (after <= energy || (force - there - A.transpose() * change.tail(A.rows())).norm() < left.norm())
          break;
      }
      q += share * dq;
      multipliers = change.tail(A.rows());
    }
    return false;
  }

 private:
  struct Part {
    LiveBody body;
    Sparse Z{};  // its nodes' displacement by q
    Eigen::VectorXd rest{}, rest_forces{};
  };

  static LiveInput outside_of(const Model& model, const PatchMesh& patch) {
    LiveInput input{.mesh = model.mesh,
                    .analysis = model.analysis,
                    .thickness = model.thickness,
                    .materials = model.materials};
    input.mesh.connectivity.clear();
    input.mesh.regions.clear();
    for (Index e = 0; e < model.mesh.elements(); ++e) {
      if (std::binary_search(patch.elements.begin(), patch.elements.end(), e)) continue;
      const auto nodes = model.mesh.element_nodes(e);
      input.mesh.connectivity.insert(input.mesh.connectivity.end(), nodes.begin(), nodes.end());
      input.mesh.regions.push_back(0);
      input.material_of_element.push_back(model.material_of_element[static_cast<std::size_t>(e)]);
    }
    return input;
  }

  static LiveInput inside_of(const Model& model, const PatchMesh& patch) {
    LiveInput input{.mesh = patch.local,
                    .analysis = model.analysis,
                    .thickness = model.thickness,
                    .materials = model.materials};
    for (const Index parent : patch.parent)
      input.material_of_element.push_back(model.material_of_element[static_cast<std::size_t>(parent)]);
    return input;
  }

  /// Number of each of the body's dofs, -1 where held.
  std::vector<Eigen::Index> number(const Model& model, const PatchMesh&) {
    std::vector<Eigen::Index> dof;
    for (const std::uint8_t fixed : model.fixed) {
      for (Eigen::Index axis = 0; axis < d_; ++axis)
        dof.push_back((fixed >> axis & 1) != 0 ? -1 : body_dofs_++);
    }
    return dof;
  }

  void begin(Part& part, const std::vector<Eigen::Triplet<double>>& entries, Eigen::Index dofs,
             const std::vector<Vec3>& rest) const {
    part.Z.resize(part.body.dofs(), dofs);
    part.Z.setFromTriplets(entries.begin(), entries.end());
    part.rest = part.body.rest();
    for (std::size_t node = 0; node < rest.size(); ++node)
      part.rest.segment(d_ * static_cast<Eigen::Index>(node), d_) += rest[node].head(d_);
    internal_forces(part.body, part.rest, {}, part.rest_forces);
  }

  /// Energy, and forces of the elements against q.
  double look(const Eigen::VectorXd& q, Eigen::VectorXd& internal) const {
    internal = Eigen::VectorXd::Zero(q.size());
    double energy = 0.0;
    for (const Part& part : parts_) {
      const Eigen::VectorXd u = part.Z * q;
      Eigen::VectorXd f;
      energy += internal_forces(part.body, part.rest + u, {}, f).energy + part.rest_forces.dot(u);
      internal += part.Z.transpose() * (part.rest_forces - f);
    }
    return energy;
  }

  Sparse tangent(const Eigen::VectorXd& q, const Sparse& A) const {
    Sparse K(q.size(), q.size());
    for (const Part& part : parts_) {
      LiveMatrix lower;
      assemble_tangent(part.body, part.rest + part.Z * q, {}, TangentKind::exact, lower);
      const Sparse whole = lower.selfadjointView<Eigen::Lower>();
      K += Sparse(part.Z.transpose() * (whole * part.Z));
    }
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](const Sparse& from, Eigen::Index row, Eigen::Index column, bool turned) {
      for (Eigen::Index k = 0; k < from.outerSize(); ++k) {
        for (Sparse::InnerIterator it(from, k); it; ++it)
          entries.emplace_back(row + (turned ? it.col() : it.row()), column + (turned ? it.row() : it.col()),
                               it.value());
      }
    };
    add(K, 0, 0, false);
    add(A, q.size(), 0, false);
    add(A, 0, q.size(), true);
    Sparse all(q.size() + A.rows(), q.size() + A.rows());
    all.setFromTriplets(entries.begin(), entries.end());
    return all;
  }

  Eigen::Index d_;
  Eigen::Index body_dofs_ = 0;
  Part parts_[2];
};

}  // namespace palpate::test
