#include "runtime/tick/linearise.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/solve/tick_tuning.h"

namespace palpate {
namespace {

/// Symmetric part, without what would push the hand on: sliding friction makes the true one unsymmetric.
Eigen::Matrix3d passive(const Eigen::Matrix3d& stiffness) noexcept {
  const Eigen::Matrix3d symmetric = 0.5 * (stiffness + stiffness.transpose());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(symmetric);
  const Eigen::Matrix3d vectors = eigen.eigenvectors();
  if (!vectors.allFinite() || !eigen.eigenvalues().allFinite()) return Eigen::Matrix3d::Zero();
  return vectors * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * vectors.transpose();
}

/// Motions along the rows when the device moves by 1 along an axis.
void fill_row_change(const State& state, Scratch& scratch, Index number, int axis) noexcept {
  const ContactProblem& problem = scratch.problem;
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    const auto first = static_cast<std::size_t>(problem.first_row(k));
    for (Index i = 0; i < problem.rows_of(k); ++i) {
      scratch.row_change[first + static_cast<std::size_t>(i)] =
          contact.tool == number ? contact.frame(axis, i) : 0.0;
    }
  }
}

/// How far a free tool may move before it touches: what its nearest contact point leaves.
void linearise_free(const State& state, ToolState& tool, Index number) noexcept {
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.tool == number)
      tool.local.radius = std::min(tool.local.radius, std::max(0.0, contact.free_gap));
  }
}

/// Change of the tool's force by a motion of 1 along an axis. Contacts that would open by it bound the
/// radius.
Vec3 force_change(const State& state, Scratch& scratch, ToolState& tool, Index number) noexcept {
  const ContactProblem& problem = scratch.problem;
  if (problem.frictionless) {
    scratch.active_set.derivative(problem, scratch.row_change, scratch.force_change);
  } else {
    scratch.cone_solver.derivative(problem, scratch.row_change, scratch.force_change);
  }
  Vec3 change = Vec3::Zero();
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    const auto first = static_cast<std::size_t>(problem.first_row(k));
    if (contact.tool == number) {
      for (Index i = 0; i < problem.rows_of(k); ++i)
        change += scratch.force_change[first + static_cast<std::size_t>(i)] * contact.frame.col(i);
    }
    if (contact.held) continue;
    const double rate = std::abs(scratch.force_change[first]);
    const double normal = problem.lambda[first];
    if (normal > 0.0 && rate > 0.0) tool.local.radius = std::min(tool.local.radius, normal / rate);
  }
  return change;
}

/// Open contact points of the tool bound the radius by their gaps.
void keep_open_contacts(const State& state, const ContactProblem& problem, ToolState& tool,
                        Index number) noexcept {
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    if (contact.held || contact.tool != number || problem.lambda[problem.first_row(k)] > 0.0) continue;
    tool.local.radius = std::min(tool.local.radius, std::max(0.0, contact.gap));
  }
}

void linearise_tool(State& state, Scratch& scratch, Index number) noexcept {
  ToolState& tool = state.tools[number];
  tool.local = {.force = tool.contact_wrench.force,
                .stiffness = Eigen::Matrix3d::Zero(),
                .point = tool.device.position,
                .radius = tool.margin};
  if (tool.tool.radius > 0.0)
    tool.local.radius = std::min(tool.local.radius, tuning.hand.curvature_share * tool.tool.radius);
  if (tool.contacts == 0) return linearise_free(state, tool, number);

  Eigen::Matrix3d change = Eigen::Matrix3d::Zero();  // of the force by a motion of the device
  std::fill_n(scratch.row_change.begin(), scratch.problem.rows, 0.0);
  for (int axis = 0; axis < scratch.problem.dimension; ++axis) {
    fill_row_change(state, scratch, number, axis);
    change.col(axis) = force_change(state, scratch, tool, number);
  }
  keep_open_contacts(state, scratch.problem, tool, number);
  if (change.allFinite()) tool.local.stiffness = passive(-change);
}

}  // namespace

void linearise(State& state, Scratch& scratch) noexcept {
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) linearise_tool(state, scratch, k);
}

}  // namespace palpate
