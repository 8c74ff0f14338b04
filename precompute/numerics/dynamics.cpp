#include "precompute/numerics/dynamics.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "precompute/numerics/lowest_modes.h"

namespace palpate {
namespace {

constexpr double bytes_per_second = 10e9;  // rate at which a step reads K_bar^-1
constexpr Index usual_modes = 100;

/// Rows of the shapes at the stored dofs, one mode after the other.
std::vector<double> at_stored_dofs(const Eigen::MatrixXd& shapes, std::span<const std::int64_t> stored_dofs) {
  std::vector<double> rows;
  rows.reserve(static_cast<std::size_t>(shapes.cols()) * stored_dofs.size());
  for (Eigen::Index i = 0; i < shapes.cols(); ++i)
    for (const std::int64_t dof : stored_dofs) rows.push_back(dof < 0 ? 0.0 : shapes(dof, i));
  return rows;
}

}  // namespace

DynamicsPlan plan_dynamics(const DynamicsOptions& options, Scope scope, std::int64_t stored_dofs,
                           const SparseMatrix& K, Precision precision) {
  constexpr auto scalar = static_cast<std::int64_t>(sizeof(double));
  const bool full = scope == Scope::full;
  const std::int64_t packed_bytes = packed_size(stored_dofs) * bytes_per_scalar(precision);
  const auto bytes = static_cast<double>(packed_bytes);
  const bool fits = bytes <= bytes_per_second * options.newmark.time_step;
  const std::string numbers = fmt::format(
      "a step reads the packed inverse of K_bar, {:.1f} MB: {:.0f} steps a second at {:.0f} GB/s, {:.0f} are "
      "asked for",
      bytes * 1e-6, bytes_per_second / bytes, bytes_per_second * 1e-9, 1.0 / options.newmark.time_step);
  const std::int64_t matrices = 2 * K.nonZeros() * 2 * scalar;  // M and K_bar with their row numbers
  DynamicsPlan plan;
  plan.method = options.method.value_or(full && fits ? DynamicsMethod::packed : DynamicsMethod::modal);
  if (plan.method == DynamicsMethod::packed) {
    if (!full)
      throw Error("[dynamics] method \"packed\" needs every free dof, but the scope is not full",
                  options.place, "set scope = \"full\" in [storage], or method = \"modal\"");
    plan.reason = numbers;
    plan.file_bytes = packed_bytes;
    plan.memory_bytes = matrices + 3 * K.nonZeros() * 3 * scalar;  // M and C_d: sorted, kept, and being
                                                                   // written
    return plan;
  }
  const std::int64_t free = K.rows();
  plan.modes = options.modes.value_or(static_cast<Index>(std::min<std::int64_t>(usual_modes, free)));
  if (plan.modes > free)
    throw Error(fmt::format("[dynamics] modes is {}, but the body has only {} free dofs", plan.modes, free),
                options.place, fmt::format("use at most {}", free));
  if (dense_modes(plan.modes, free) && free > most_dense_dofs) {
    throw Error(fmt::format("[dynamics] modes is {}, more than a third of {} free dofs: that takes a dense "
                            "matrix of all of them",
                            plan.modes, free),
                options.place,
                fmt::format("use at most {}, or mesh the body with at most {} free dofs", free / 3 - 1,
                            most_dense_dofs));
  }
  plan.reason = options.method ? "as told" : full ? numbers : "the scope is not full";
  plan.file_bytes = plan.modes * stored_dofs * scalar;
  plan.memory_bytes = matrices + modes_bytes(plan.modes, free) + 2 * plan.file_bytes;
  return plan;
}

MassAndDamping mass_and_damping(const SparseMatrix& K, const SparseMatrix& M, const Rayleigh& damping,
                                std::span<const std::int64_t> stored_dofs) {
  std::vector<std::int64_t> place(static_cast<std::size_t>(K.rows()), -1);  // stored dof of each dof of K
  for (std::size_t s = 0; s < stored_dofs.size(); ++s)
    if (stored_dofs[s] >= 0) place[static_cast<std::size_t>(stored_dofs[s])] = static_cast<std::int64_t>(s);
  struct Entry {
    std::int64_t column, row;
    double mass, damping;
  };
  std::vector<Entry> entries;
  for (std::int64_t j = 0; j < K.cols(); ++j) {
    for (std::int64_t k = K.outerIndexPtr()[j]; k < K.outerIndexPtr()[j + 1]; ++k) {
      const std::int64_t a = place[static_cast<std::size_t>(j)],
                         b = place[static_cast<std::size_t>(K.innerIndexPtr()[k])];
      const double m = M.valuePtr()[k], c = damping.mass * m + damping.stiffness * K.valuePtr()[k];
      if (a >= 0 && b >= 0 && (m != 0.0 || c != 0.0))
        entries.push_back({std::min(a, b), std::max(a, b), m, c});
    }
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.column != b.column ? a.column < b.column : a.row < b.row;
  });
  MassAndDamping result;
  result.start.assign(stored_dofs.size() + 1, 0);
  for (const Entry& entry : entries) {
    ++result.start[static_cast<std::size_t>(entry.column) + 1];
    result.row.push_back(static_cast<Index>(entry.row));
    result.mass.push_back(entry.mass);
    result.damping.push_back(entry.damping);
  }
  for (std::size_t s = 0; s < stored_dofs.size(); ++s) result.start[s + 1] += result.start[s];
  return result;
}

std::optional<StoredDynamics> describe_dynamics(const DynamicsOptions& options, const DynamicsPlan& plan,
                                                const SparseMatrix& K, const SparseMatrix& M,
                                                const Factor& factor,
                                                std::span<const std::int64_t> stored_dofs,
                                                const std::function<bool()>& stopped) {
  StoredDynamics result;
  result.method = plan.method;
  result.lumped = options.lumped;
  result.newmark = options.newmark;
  result.damping = options.damping;
  if (plan.method == DynamicsMethod::packed) {
    result.matrices = mass_and_damping(K, M, options.damping, stored_dofs);
  } else {
    std::optional<LowestModes> modes = lowest_modes(factor, K, M, plan.modes, stopped);
    if (!modes) return {};
    result.omega = std::move(modes->omega);
    result.shapes = at_stored_dofs(modes->shapes, stored_dofs);
  }
  return result;
}

std::vector<std::int64_t> stored_dofs_of(const Model& model, const Stiffness& stiffness) {
  const int d = model.dimension();
  std::vector<std::int64_t> dofs;
  for (const Index node : model.stored_nodes)
    for (int axis = 0; axis < d; ++axis)
      dofs.push_back(stiffness.free_of_dof[static_cast<std::size_t>(std::int64_t{d} * node + axis)]);
  return dofs;
}

}  // namespace palpate
