// What a file keeps for Newmark's method, in memory, by plain solves: for models that are small.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "precompute/numerics/dynamics.h"

namespace palpate::test {

/// K_bar^-1 of the stored dofs, column by column.
template <class T>
std::shared_ptr<const void> packed_inverse(const Factor& K_bar, std::span<const std::int64_t> stored_dofs) {
  auto values = std::make_shared<std::vector<T>>();
  values->reserve(static_cast<std::size_t>(packed_size(std::ssize(stored_dofs))));
  for (std::size_t j = 0; j < stored_dofs.size(); ++j) {
    std::vector<double> e(static_cast<std::size_t>(K_bar.order()), 0.0);
    if (stored_dofs[j] >= 0) e[static_cast<std::size_t>(stored_dofs[j])] = 1.0;
    const std::vector<double> x = K_bar.solve(e);
    for (std::size_t i = j; i < stored_dofs.size(); ++i)
      values->push_back(
          static_cast<T>(stored_dofs[i] < 0 ? 0.0 : x[static_cast<std::size_t>(stored_dofs[i])]));
  }
  return {values, values->data()};
}

/// All of it, of a model that has mesh, materials, held nodes, scope and stored nodes; K_bar^-1 in the given
/// precision.
inline StoredDynamics make_dynamics(const Model& model, const DynamicsOptions& options, Precision precision) {
  const StiffnessInput body = stiffness_input(model);
  const Stiffness stiffness = assemble_stiffness(body);
  const SparseMatrix M = assemble_mass(body, stiffness, options.lumped);
  const std::vector<std::int64_t> stored_dofs = stored_dofs_of(model, stiffness);
  const DynamicsPlan plan = plan_dynamics(options, model.scope, model.stored_dofs(), stiffness.K, precision);
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  StoredDynamics result =
      *describe_dynamics(options, plan, stiffness.K, M, factor, stored_dofs, [] { return false; });
  if (plan.method != DynamicsMethod::packed) return result;

  const SparseMatrix K_bar = effective_stiffness(stiffness.K, M, options.damping, options.newmark);
  Factor factor_bar(K_bar, stiffness.node_start);
  factor_bar.factorize();
  result.inverse =
      PackedGreens(has_float_entries(precision) ? packed_inverse<float>(factor_bar, stored_dofs)
                                                : packed_inverse<double>(factor_bar, stored_dofs),
                   model.stored_dofs(), precision);
  return result;
}

}  // namespace palpate::test
