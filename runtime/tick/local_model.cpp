#include "runtime/tick/local_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/tick/state.h"

namespace palpate {
namespace {

constexpr double curvature_share = 0.1;  // of the tool's radius: farther, the normals turn too much

/// Symmetric part, without what would push the hand on: sliding friction makes the true one unsymmetric.
Eigen::Matrix3d passive(const Eigen::Matrix3d& stiffness) noexcept {
  const Eigen::Matrix3d symmetric = 0.5 * (stiffness + stiffness.transpose());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(symmetric);
  const Eigen::Matrix3d vectors = eigen.eigenvectors();
  if (!vectors.allFinite() || !eigen.eigenvalues().allFinite()) return Eigen::Matrix3d::Zero();
  return vectors * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * vectors.transpose();
}

void linearise_tool(State& state, Index number) noexcept {
  ToolState& tool = state.tools[static_cast<std::size_t>(number)];
  const ContactProblem& problem = state.problem;
  tool.local = {.force = tool.contact_wrench.force,
                .stiffness = Eigen::Matrix3d::Zero(),
                .point = tool.device.position,
                .radius = tool.margin};
  if (tool.tool.radius > 0.0)
    tool.local.radius = std::min(tool.local.radius, curvature_share * tool.tool.radius);
  if (tool.contacts == 0) {
    for (Index k = 0; k < state.contact_count; ++k) {
      const ContactPoint& contact = state.contact_points[static_cast<std::size_t>(k)];
      if (contact.tool == number)
        tool.local.radius = std::min(tool.local.radius, std::max(0.0, contact.free_gap));
    }
    return;
  }

  Eigen::Matrix3d change = Eigen::Matrix3d::Zero();  // of the force by a motion of the device
  std::fill_n(state.row_change.begin(), problem.rows, 0.0);
  for (int axis = 0; axis < problem.dimension; ++axis) {
    for (Index k = 0; k < state.contact_count; ++k) {
      const ContactPoint& contact = state.contact_points[static_cast<std::size_t>(k)];
      const auto first = static_cast<std::size_t>(problem.first_row(k));
      for (Index i = 0; i < problem.rows_of(k); ++i) {
        state.row_change[first + static_cast<std::size_t>(i)] =
            contact.tool == number ? contact.frame(axis, i) : 0.0;
      }
    }
    if (problem.frictionless) {
      state.active_set.derivative(problem, state.row_change, state.force_change);
    } else {
      state.cone_solver.derivative(problem, state.row_change, state.force_change);
    }
    for (Index k = 0; k < state.contact_count; ++k) {
      const ContactPoint& contact = state.contact_points[static_cast<std::size_t>(k)];
      const auto first = static_cast<std::size_t>(problem.first_row(k));
      if (contact.tool == number) {
        for (Index i = 0; i < problem.rows_of(k); ++i)
          change.col(axis) += state.force_change[first + static_cast<std::size_t>(i)] * contact.frame.col(i);
      }
      if (contact.held) continue;
      const double rate = std::abs(state.force_change[first]);
      const double normal = problem.lambda[first];
      if (normal > 0.0 && rate > 0.0) tool.local.radius = std::min(tool.local.radius, normal / rate);
    }
  }
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[static_cast<std::size_t>(k)];
    if (contact.held || contact.tool != number ||
        problem.lambda[static_cast<std::size_t>(problem.first_row(k))] > 0.0)
      continue;
    tool.local.radius = std::min(tool.local.radius, std::max(0.0, contact.gap));
  }
  if (change.allFinite()) tool.local.stiffness = passive(-change);
}

}  // namespace

void linearise(State& state) noexcept {
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) linearise_tool(state, k);
}

}  // namespace palpate
