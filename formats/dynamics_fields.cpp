#include "formats/dynamics_fields.h"

#include <algorithm>
#include <cmath>

#include "formats/field_counts.h"

namespace palpate {
namespace {

bool is_held(const Model& model, std::int64_t stored_dof) {
  const int d = model.dimension();
  const Index node = model.stored_nodes[static_cast<std::size_t>(stored_dof / d)];
  return (model.fixed[static_cast<std::size_t>(node)] >> stored_dof % d & 1) != 0;
}

std::int64_t free_dofs(const Model& model) {
  std::int64_t count = 0;
  for (const std::uint8_t fixed : model.fixed)
    for (int axis = 0; axis < model.dimension(); ++axis) count += (fixed >> axis & 1) == 0 ? 1 : 0;
  return count;
}

void check_newmark(const StoredDynamics& dynamics, const std::string& where) {
  const Newmark& newmark = dynamics.newmark;
  if (!(newmark.time_step > 0.0))
    refuse(where, "/dynamics/newmark: the time step is " + std::to_string(newmark.time_step) + " s");
  if (!newmark.stable())
    refuse(where, "/dynamics/newmark: alpha = " + std::to_string(newmark.alpha) +
                      " and delta = " + std::to_string(newmark.delta) + " are not unconditionally stable");
  if (dynamics.damping.mass < 0.0 || dynamics.damping.stiffness < 0.0)
    refuse(where, "/dynamics/damping is negative");
}

/// Checks column `j` of M and C_d.
void check_column(const Model& model, std::int64_t j, const std::string& where) {
  const MassAndDamping& matrices = model.dynamics.matrices;
  const std::string column = ": column " + std::to_string(j);
  const auto from = static_cast<std::size_t>(matrices.start[static_cast<std::size_t>(j)]),
             to = static_cast<std::size_t>(matrices.start[static_cast<std::size_t>(j) + 1]);
  if (is_held(model, j)) {
    if (from != to)
      refuse(where, "/dynamics/matrices/start" + column + " has entries, though its dof is held");
    return;
  }
  if (from == to || matrices.row[from] != j)
    refuse(where, "/dynamics/matrices/row" + column + " does not begin on the diagonal");
  if (!(matrices.mass[from] > 0.0))
    refuse(where, "/dynamics/matrices/mass" + column + " has no positive mass on the diagonal");
  if (matrices.damping[from] < 0.0)
    refuse(where, "/dynamics/matrices/damping" + column + " has a negative diagonal entry");
  for (std::size_t k = from + 1; k < to; ++k) {
    if (matrices.row[k] <= matrices.row[k - 1])
      refuse(where, "/dynamics/matrices/row" + column + " does not ascend");
    if (is_held(model, matrices.row[k]))
      refuse(where, "/dynamics/matrices/row" + column + " has an entry of a held dof");
    if (model.dynamics.lumped && matrices.mass[k] != 0.0)
      refuse(where, "/dynamics/matrices/mass" + column + " is not diagonal, though the mass is lumped");
  }
}

void check_packed(const Model& model, const std::string& where) {
  const int all_axes = (1 << model.dimension()) - 1;
  const auto movable = std::count_if(model.fixed.begin(), model.fixed.end(),
                                     [&](std::uint8_t fixed) { return fixed != all_axes; });
  if (model.scope != Scope::full || movable != std::ssize(model.stored_nodes))
    refuse(where, "/dynamics/method is packed, but not every node that can move is stored");
  const MassAndDamping& matrices = model.dynamics.matrices;
  if (matrices.start.front() != 0 || matrices.start.back() != std::ssize(matrices.row))
    refuse(where, "/dynamics/matrices/start does not go from 0 to " + std::to_string(matrices.row.size()));
  for (std::size_t j = 0; j + 1 < matrices.start.size(); ++j)
    if (matrices.start[j] > matrices.start[j + 1])
      refuse(where, "/dynamics/matrices/start descends at entry " + std::to_string(j + 1));
  for (std::int64_t j = 0; j < model.stored_dofs(); ++j) check_column(model, j, where);
}

void check_modes(const Model& model, const std::string& where) {
  const StoredDynamics& dynamics = model.dynamics;
  const std::int64_t modes = dynamics.modes(), free = free_dofs(model), n = model.stored_dofs();
  if (modes > free)
    refuse(where, "/dynamics/modes/omega has " + std::to_string(modes) + " modes of a body with " +
                      std::to_string(free) + " free dofs");
  double before = 0.0;
  for (std::size_t i = 0; i < dynamics.omega.size(); ++i) {
    const double omega = dynamics.omega[i];
    if (!(omega > 0.0) || omega < before)
      refuse(where, "/dynamics/modes/omega is not positive and ascending (entry " + std::to_string(i) + ")");
    if (std::isinf(omega) != (static_cast<std::int64_t>(i) == free))
      refuse(where, "/dynamics/modes/omega: entry " + std::to_string(i) +
                        (std::isinf(omega) ? " is infinite" : " is finite, though there is no such mode"));
    before = omega;
  }
  for (std::int64_t dof = 0; dof < n; ++dof) {
    if (!is_held(model, dof)) continue;
    for (std::int64_t i = 0; i < modes; ++i) {
      if (dynamics.shapes[static_cast<std::size_t>(i * n + dof)] != 0.0)
        refuse(where, "/dynamics/modes/shapes: mode " + std::to_string(i) + " moves dof " +
                          std::to_string(dof) + ", which is held");
    }
  }
}

}  // namespace

std::vector<double> newmark_of(const Model& model) {
  const Newmark& newmark = model.dynamics.newmark;
  return {newmark.alpha, newmark.delta, newmark.time_step};
}

void put_newmark(Model& model, const std::vector<double>& values) {
  model.dynamics.newmark = {.alpha = values[0], .delta = values[1], .time_step = values[2]};
}

void put_method(Model& model, const std::vector<std::int32_t>& values) {
  for (const DynamicsMethod method : {DynamicsMethod::packed, DynamicsMethod::modal}) {
    if (values[0] != static_cast<std::int32_t>(method)) continue;
    model.dynamics.method = method;
    return;
  }
  throw Unreadable{"is " + std::to_string(values[0]) + ", not 1 (packed) or 2 (modal)"};
}

void check_dynamics(const Model& model, const std::string& where) {
  check_newmark(model.dynamics, where);
  if (model.dynamics.method == DynamicsMethod::packed)
    check_packed(model, where);
  else
    check_modes(model, where);
}

}  // namespace palpate
