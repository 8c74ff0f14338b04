#include "runtime/core/tick/linearise.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/force_error.h"
#include "runtime/core/tick/greens_error.h"
#include "runtime/core/tick/linearise_rolling.h"
#include "runtime/core/touch/rolling.h"

namespace palpate {
namespace {

/// Positive semidefinite part of the symmetric part: sliding friction makes the true stiffness unsymmetric,
/// and negative stiffness would drive the hand.
Eigen::Matrix3d passive(const Eigen::Matrix3d& stiffness) noexcept {
  const Eigen::Matrix3d symmetric = 0.5 * (stiffness + stiffness.transpose());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(symmetric);
  const Eigen::Matrix3d vectors = eigen.eigenvectors();
  if (!vectors.allFinite() || !eigen.eigenvalues().allFinite()) return Eigen::Matrix3d::Zero();
  return vectors * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * vectors.transpose();
}

/// Computes the motions along the rows for a displacement `motion` of the device and a rotation `turn` about
/// its origin: [rows] of scratch.changes.of_rows from `begin` on.
void fill_row_change(const State& state, Scratch& scratch, Index number, const Vec3& motion, const Vec3& turn,
                     Index begin = 0) noexcept {
  const ContactProblem& problem = scratch.problem;
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    const Index first = problem.first_row(k);
    Vec3 there = contact.tool == number ? motion : Vec3::Zero();
    if (contact.tool == number && !contact.rolls) there += turn.cross(contact.arm);
    for (Index i = first; i < first + problem.rows_of(k); ++i)
      scratch.changes.of_rows[begin + i] = scratch.rows[i].force.dot(there);
  }
  for (Index i = problem.first_row(state.contact_count); i < problem.rows; ++i)
    scratch.changes.of_rows[begin + i] =
        scratch.rows[i].tool == number ? scratch.rows[i].force.dot(motion) : 0.0;
}

/// Sets the radius of a free tool: the gap of its nearest contact point.
void linearise_free(const State& state, ToolState& tool, Index number) noexcept {
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.tool == number)
      tool.local.radius = std::min(tool.local.radius, std::max(0.0, contact.free_gap));
  }
}

/// Change of the tool's wrench by the change of forces starting at `begin` in scratch.changes.of_forces.
Wrench wrench_of(const State& state, const Scratch& scratch, Index number, Index begin) noexcept {
  const ContactProblem& problem = scratch.problem;
  Wrench change;
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    if (contact.tool != number) continue;
    const Index first = problem.first_row(k);
    Vec3 force = Vec3::Zero();
    for (Index i = first; i < first + problem.rows_of(k); ++i)
      force += scratch.changes.of_forces[begin + i] * scratch.rows[i].force;
    change.force += force;
    if (!contact.rolls) change.torque += contact.arm.cross(force);
  }
  for (Index i = problem.first_row(state.contact_count); i < problem.rows; ++i) {
    if (scratch.rows[i].tool == number)
      change.force += scratch.changes.of_forces[begin + i] * scratch.rows[i].force;
  }
  return change;
}

/// Bounds the radius by the contacts that would open, from the change of forces per unit of motion starting
/// at `begin`.
void keep_closed_contacts(const State& state, const Scratch& scratch, ToolState& tool, Index begin) noexcept {
  const ContactProblem& problem = scratch.problem;
  const std::span<const double> change =
      std::span(scratch.changes.of_forces).subspan(static_cast<std::size_t>(begin));
  for (Index k = 0; k < state.contact_count; ++k) {
    if (state.contact_points[k].held) continue;
    const double rate = std::abs(problem.normal_part(k, change));
    const double normal = problem.normal_part(k, problem.lambda);
    if (normal > 0.0 && rate > 0.0) tool.local.radius = std::min(tool.local.radius, normal / rate);
  }
}

/// Bounds the radius by the gaps of the tool's open contact points.
void keep_open_contacts(const State& state, const ContactProblem& problem, ToolState& tool,
                        Index number) noexcept {
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    if (contact.held || contact.tool != number || problem.normal_part(k, problem.lambda) > 0.0) continue;
    tool.local.radius = std::min(tool.local.radius, std::max(0.0, contact.gap));
  }
}

/// Initialises changes of forces with those of the last tick, for many contacts.
void guess_force_changes(const State& state, Scratch& scratch, Index number) noexcept {
  const ContactProblem& problem = scratch.problem;
  const int d = problem.dimension;
  std::fill_n(scratch.changes.of_forces.begin(), d * problem.rows, 0.0);
  for (Index k = 0; k < scratch.assembly.response_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    if (contact.tool != number) continue;
    for (Index i = problem.first_row(k); i < problem.first_row(k) + problem.rows_of(k); ++i) {
      for (int axis = 0; axis < d; ++axis)
        scratch.changes.of_forces[axis * problem.rows + i] =
            scratch.rows[i].force.dot(scratch.assembly.response[k].col(axis));
    }
  }
}

void keep_force_changes(const State& state, Scratch& scratch, Index number) noexcept {
  const ContactProblem& problem = scratch.problem;
  for (Index k = 0; k < scratch.assembly.response_count; ++k) {
    if (state.contact_points[k].tool != number) continue;
    Eigen::Matrix3d& response = scratch.assembly.response[k];
    response.setZero();
    for (Index i = problem.first_row(k); i < problem.first_row(k) + problem.rows_of(k); ++i) {
      for (int axis = 0; axis < problem.dimension; ++axis)
        response.col(axis) += scratch.changes.of_forces[axis * problem.rows + i] * scratch.rows[i].force;
    }
  }
}

/// Change of the tool's wrench by the rotation of the device in this tick. Held points rotate with the tool.
Wrench change_by_turning(const State& state, Scratch& scratch, const ToolState& tool, Index number) noexcept {
  if (tool.device.orientation.coeffs() == tool.last_device.orientation.coeffs()) return {};
  const Eigen::AngleAxisd turned(tool.device.orientation * tool.last_device.orientation.conjugate());
  const Vec3 turn = turned.angle() * turned.axis();
  fill_row_change(state, scratch, number, Vec3::Zero(), turn);
  std::fill_n(scratch.changes.of_forces.begin(), scratch.problem.rows, 0.0);
  scratch.solver.derivative(scratch.problem, 1, scratch.changes.of_rows, scratch.changes.of_forces);
  Wrench change = wrench_of(state, scratch, number, 0);
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.tool == number && contact.held) change.torque += turn.cross(contact.arm).cross(contact.force);
  }
  return change;
}

void linearise_tool(State& state, Scratch& scratch, Index number, double edge) noexcept {
  ToolState& tool = state.tools[number];
  tool.local = {.force = tool.contact_wrench.force,
                .stiffness = Eigen::Matrix3d::Zero(),
                .point = tool.device.position,
                .radius = tool.margin};
  tool.explained = {};
  if (tool.tool.radius > 0.0)
    tool.local.radius = std::min(tool.local.radius, tuning.hand.curvature_share * tool.tool.radius);
  if (tool.contacts == 0) return linearise_free(state, tool, number);

  const int d = scratch.problem.dimension;
  const Index rows = scratch.problem.rows;
  const auto count = static_cast<std::size_t>(rows);
  for (int axis = 0; axis < d; ++axis)
    fill_row_change(state, scratch, number, Vec3::Unit(axis), Vec3::Zero(), axis * rows);
  guess_force_changes(state, scratch, number);
  const bool rolls = begin_rolling(state, scratch, number, rolling_radius(tool.tool, edge));
  Eigen::Matrix3d force = Eigen::Matrix3d::Zero();  // change by a motion of the device
  if (rolls) {
    force = force_change_by_rolling(state, scratch, number);
  } else {
    scratch.solver.derivative(scratch.problem, d, scratch.changes.of_rows, scratch.changes.of_forces);
  }
  keep_force_changes(state, scratch, number);
  Eigen::Matrix3d torque = Eigen::Matrix3d::Zero();
  for (int axis = 0; axis < d; ++axis) {
    const Wrench change = wrench_of(state, scratch, number, axis * rows);
    if (!rolls) force.col(axis) = change.force;
    torque.col(axis) = change.torque;
    keep_closed_contacts(state, scratch, tool, axis * rows);
    note_answer(scratch, number, axis, axis * rows);
    tool.greens_error =
        std::hypot(tool.greens_error,
                   greens_error(state.surface.near, scratch.greens_error, {scratch.rows.data(), count},
                                {scratch.changes.of_forces.data() + std::ptrdiff_t{axis} * rows, count}));
  }
  keep_open_contacts(state, scratch.problem, tool, number);
  if (force.allFinite()) tool.local.stiffness = passive(-force);

  const Vec3 moved = tool.device.position - tool.last_device.position - tool.surface_change;
  const Wrench turning = change_by_turning(state, scratch, tool, number);
  tool.explained = {.force = turning.force - tool.local.stiffness * moved,
                    .torque = turning.torque + torque * moved};
}

}  // namespace

void linearise(const ElasticBody& body, State& state, Scratch& scratch) noexcept {
  begin_force_error(scratch);
  begin_greens_error(state.surface.near, scratch.greens_error);
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k)
    linearise_tool(state, scratch, k, body.mean_surface_edge());
}

}  // namespace palpate
