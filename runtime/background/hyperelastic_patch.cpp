#include "runtime/background/hyperelastic_patch.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "meshes/element.h"
#include "runtime/body/overlay.h"
#include "runtime/core/body/patch.h"
#include "statics/live_forces.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int most_cuts = 30;
constexpr double least_fall = 1e-4;  // fraction of the decrease predicted by the slope

/// The fine mesh as a live body without supports.
LiveInput input_of(const Model& model, const PatchMesh& mesh) {
  LiveInput input{.mesh = mesh.local,
                  .analysis = model.analysis,
                  .thickness = model.thickness,
                  .materials = model.materials};
  for (const Index parent : mesh.parent)
    input.material_of_element.push_back(model.material_of_element[static_cast<std::size_t>(parent)]);
  return input;
}

/// Xi_QQ^-1, with an arbitrary uncoupled stiffness for held dofs.
MatrixXd stiffness_at(const Body& body, std::span<const Index> stored) {
  MatrixXd greens = greens_at(body, stored);
  greens = 0.5 * (greens + greens.transpose()).eval();
  const double mean = greens.trace() / static_cast<double>(greens.rows());
  for (Eigen::Index dof = 0; dof < greens.rows(); ++dof) {
    if (greens(dof, dof) == 0.0) greens(dof, dof) = mean;
  }
  return greens.llt().solve(MatrixXd::Identity(greens.rows(), greens.cols()));
}

}  // namespace

HyperelasticPatch::HyperelasticPatch(const Body& body, PatchMesh mesh)
    : body_(body),
      mesh_(std::move(mesh)),
      live_(input_of(body.model(), mesh_), {.law = LiveLaw::neo_hookean}),
      condensation_(body.model(), mesh_, memory_),
      stored_(stored_nodes_of(body, mesh_)),
      local_of_surface_(body.surface_rest_positions().size(), -1),
      stiffness_(stiffness_at(body, stored_)),
      linear_(patch_stiffness(body.model(), mesh_)) {
  const std::vector<Index> local = surface_nodes(mesh_);
  const std::vector<Index> numbers = surface_numbers(body, mesh_, local);
  for (std::size_t k = 0; k < local.size(); ++k)
    local_of_surface_[static_cast<std::size_t>(numbers[k])] = local[k];

  const Eigen::Index d = body.dimension();
  at_rest_ = live_.rest();
  for (std::size_t node = 0; node < mesh_.rest_displacement.size(); ++node)
    at_rest_.segment(d * static_cast<Eigen::Index>(node), d) += mesh_.rest_displacement[node].head(d);
  internal_forces(live_, at_rest_, {}, rest_forces_);
  rounding_ = 1e-13 * linear_.norm() * (at_rest_.maxCoeff() - at_rest_.minCoeff());
  place_.u_Q = VectorXd::Zero(linear_.rows());
  place_.u_L = VectorXd::Zero(mesh_.free_dofs);
}

HyperelasticPatch::Load HyperelasticPatch::read(std::span<const Index> surface_nodes,
                                                std::span<const Vec3> forces) const {
  const Eigen::Index d = body_.dimension();
  Load load{.local = VectorXd::Zero(at_rest_.size()), .beside = VectorXd::Zero(linear_.rows())};
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(d, linear_.rows());
  for (std::size_t k = 0; k < surface_nodes.size(); ++k) {
    const Index local = local_of_surface_[static_cast<std::size_t>(surface_nodes[k])];
    if (local >= 0) {
      load.local.segment(d * local, d) += forces[k].head(d);
      continue;
    }
    const SurfaceParts parts = body_.surface_parts(surface_nodes[k]);
    for (std::size_t part = 0; part < parts.stored.size(); ++part) {
      body_.greens().gather(parts.stored[part], stored_,
                            {rows.data(), static_cast<std::size_t>(rows.size())});
      load.beside += parts.weights[part] * (rows.transpose() * forces[k].head(d));
    }
  }
  return load;
}

VectorXd HyperelasticPatch::displacement(const Place& place) const {
  VectorXd u = condensation_.shape() * place.u_Q;
  for (std::size_t dof = 0; dof < mesh_.free_dof.size(); ++dof) {
    if (mesh_.free_dof[dof] >= 0) u[static_cast<Eigen::Index>(dof)] += place.u_L[mesh_.free_dof[dof]];
  }
  return u;
}

VectorXd HyperelasticPatch::free_part(const VectorXd& local) const {
  VectorXd part(mesh_.free_dofs);
  for (std::size_t dof = 0; dof < mesh_.free_dof.size(); ++dof) {
    if (mesh_.free_dof[dof] >= 0) part[mesh_.free_dof[dof]] = local[static_cast<Eigen::Index>(dof)];
  }
  return part;
}

HyperelasticPatch::Look HyperelasticPatch::look(const Place& place, const Load& load) const {
  const VectorXd u = displacement(place);
  Look at;
  VectorXd f;
  const ForceSums sums = internal_forces(live_, at_rest_ + u, {}, f);
  at.inverted = sums.inverted;
  at.internal = rest_forces_ - f;
  const VectorXd by_patch = linear_ * place.u_Q, moved = place.u_Q - load.beside,
                 by_body = stiffness_ * moved;
  at.energy = sums.energy + rest_forces_.dot(u) - 0.5 * place.u_Q.dot(by_patch) + 0.5 * moved.dot(by_body) -
              load.local.dot(u);
  const VectorXd left = load.local - at.internal;
  at.left_Q = condensation_.shape().transpose() * left + by_patch - by_body;
  at.left_L = free_part(left);
  at.size = std::max({at.internal.norm(), load.local.norm(), (stiffness_ * load.beside).norm()});
  return at;
}

/// Condenses the tangent at the present state, with forces [d local nodes] beside it.
bool HyperelasticPatch::set_tangent(const VectorXd& forces) {
  const VectorXd x = at_rest_ + displacement(place_), f = free_part(forces);
  for (const TangentKind kind : {TangentKind::exact, TangentKind::positive}) {
    assemble_tangent(live_, x, {}, kind, K_);
    if (kind == TangentKind::positive) {  // the positive part may be singular
      for (const Index place : live_.pattern().diagonal()) K_.valuePtr()[place] *= 1.0 + 1e-8;
    }
    condensation_.clear();
    for (Eigen::Index column = 0; column < K_.outerSize(); ++column) {
      for (LiveMatrix::InnerIterator entry(K_, column); entry; ++entry)
        condensation_.add(entry.row(), column, entry.value());
    }
    if (!condensation_.factorise(f)) continue;
    around_.compute(stiffness_ - linear_ + condensation_.stiffness());
    if (around_.info() == Eigen::Success) return true;
  }
  return false;
}

/// Computes the Newton step. False if there is none.
bool HyperelasticPatch::direction(const Look& look, Place& step) {
  const Eigen::Index local = at_rest_.size();
  VectorXd left = VectorXd::Zero(local);
  for (std::size_t dof = 0; dof < mesh_.free_dof.size(); ++dof) {
    if (mesh_.free_dof[dof] >= 0) left[static_cast<Eigen::Index>(dof)] = look.left_L[mesh_.free_dof[dof]];
  }
  if (!set_tangent(left)) return false;
  step.u_Q = around_.solve(look.left_Q - condensation_.forces_on_body());
  step.u_L = condensation_.local_displacement(step.u_Q);
  return true;
}

double HyperelasticPatch::share_of(const Look& look, double largest) const {
  const double left = std::hypot(look.left_Q.norm(), look.left_L.norm());
  return left > rounding_ ? left / largest : 0.0;
}

PatchBalance HyperelasticPatch::find(std::span<const Index> surface_nodes, std::span<const Vec3> forces,
                                     const PatchEffort& effort) {
  const Load load = read(surface_nodes, forces);
  PatchBalance report;
  Look now = look(place_, load);
  double largest = now.size;
  for (;; ++report.steps) {
    report.inverted = now.inverted;
    report.residual = share_of(now, largest);
    report.converged = report.residual <= effort.tolerance;
    Place step;
    if (report.converged || report.steps == effort.most_steps || !direction(now, step)) break;
    const double slope = now.left_Q.dot(step.u_Q) + now.left_L.dot(step.u_L),
                 before = std::hypot(now.left_Q.norm(), now.left_L.norm());
    double share = 1.0;
    bool is_lower = false;
    Place tried;
    Look there;
    for (int cut = 0; cut <= most_cuts && !is_lower; ++cut, share *= 0.5) {
      tried = {place_.u_Q + share * step.u_Q, place_.u_L + share * step.u_L};
      there = look(tried, load);
      // Near convergence the energy is lost in rounding, and the forces decide.
      is_lower = there.energy <= now.energy - least_fall * share * slope ||
                 std::hypot(there.left_Q.norm(), there.left_L.norm()) < 0.5 * before;
      report.cuts += is_lower ? 0 : 1;
    }
    if (!is_lower) break;
    place_ = std::move(tried);
    now = std::move(there);
    largest = std::max(largest, now.size);
  }
  return report;
}

std::shared_ptr<const Patch> HyperelasticPatch::linearise() {
  VectorXd f;
  const VectorXd u = displacement(place_);
  internal_forces(live_, at_rest_ + u, {}, f);
  const VectorXd internal = rest_forces_ - f;
  if (!set_tangent(internal)) return nullptr;
  const CondensedPatch condensed = condensation_.condensed(linear_);
  PatchOffset offset{.forces = linear_ * place_.u_Q - condensation_.shape().transpose() * internal -
                               condensed.G * place_.u_Q + condensation_.forces_on_body(),
                     .surface = -condensed.T * place_.u_Q - condensation_.by_forces()};
  const Eigen::Index d = body_.dimension();
  for (Eigen::Index dof = 0; dof < offset.surface.size(); ++dof)
    offset.surface[dof] += u[d * condensed.surface[static_cast<std::size_t>(dof / d)] + dof % d];
  return make_patch(body_, mesh_, condensed, offset);
}

}  // namespace palpate
