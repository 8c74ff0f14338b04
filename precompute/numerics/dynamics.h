// Data for Newmark's method in the file (theory.md section 5).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "precompute/description/description.h"
#include "precompute/numerics/assembly.h"
#include "precompute/numerics/factor.h"

namespace palpate {

/// Plan for storing dynamics, made before anything is factorised.
struct DynamicsPlan {
  DynamicsMethod method = DynamicsMethod::none;
  Index modes = 0;                ///< modal
  std::int64_t file_bytes = 0;    ///< for the packed inverse or the shapes, most of the data
  std::int64_t memory_bytes = 0;  ///< besides factor and workspaces
  std::string reason;             ///< reason for this method, with the numbers: one sentence
};

/// Chooses the method if it is not given: packed if the scope is full and K_bar^-1 can be read once per time
/// step at 10 GB/s. Throws Error for packed without the full scope and for more modes than free dofs.
DynamicsPlan plan_dynamics(const DynamicsOptions& options, Scope scope, std::int64_t stored_dofs,
                           const SparseMatrix& K, Precision precision);

/// M and C_d = a M + b K of the stored dofs. `stored_dofs`: dof of K of each, -1 if held (its row and column
/// are empty). K and M are lower triangles with the same pattern.
MassAndDamping mass_and_damping(const SparseMatrix& K, const SparseMatrix& M, const Rayleigh& damping,
                                std::span<const std::int64_t> stored_dofs);

/// Everything but the packed inverse. `factor`: of K, computed. Nothing once `stopped`.
std::optional<StoredDynamics> describe_dynamics(const DynamicsOptions& options, const DynamicsPlan& plan,
                                                const SparseMatrix& K, const SparseMatrix& M,
                                                const Factor& factor,
                                                std::span<const std::int64_t> stored_dofs,
                                                const std::function<bool()>& stopped);

/// Dof of K of each stored dof of the model, -1 if held.
std::vector<std::int64_t> stored_dofs_of(const Model& model, const Stiffness& stiffness);

}  // namespace palpate
