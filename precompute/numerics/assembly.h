// Assembly of the stiffness matrix.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/model.h"

namespace palpate {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>;

/// K of the free dofs, and their coupling to the held ones. A dof of the mesh is d node + axis.
struct Stiffness {
  std::vector<std::int64_t> free_dofs;    ///< [n] dof of the mesh of each free dof, ascending
  std::vector<std::int64_t> free_of_dof;  ///< [d N] free dof of each dof of the mesh, -1 if held
  std::vector<std::int64_t> node_start;   ///< [free nodes + 1] first free dof of each node that has any
  SparseMatrix K;  ///< [n, n] lower triangle [N/m]; the block of each pair of neighbour nodes is complete
  std::vector<double> held_force;  ///< [n] K_fc u_c: force on the free dofs that the prescribed displacements
                                   ///< of the held ones require [N]
};

/// Data from which K is assembled. `prescribed` [N] may be empty: all held dofs stay at zero.
struct StiffnessInput {
  const Mesh& mesh;
  Analysis analysis;
  double thickness;
  std::span<const Material> materials;
  std::span<const Index> material_of_element;
  std::span<const std::uint8_t> fixed;
  std::span<const Vec3> prescribed;
};

/// StiffnessInput of a baked model.
StiffnessInput stiffness_input(const Model& model);

/// K = sum over elements, of tet4a over its strain domains, of the integral of t B^T D B (theory.md section
/// 1). At least one dof must be free.
Stiffness assemble_stiffness(const StiffnessInput& body);

/// M = sum over elements of the integral of t density N^T N [kg], of the free dofs, in K's pattern, the lower
/// triangle; consistent or `lumped`.
SparseMatrix assemble_mass(const StiffnessInput& body, const Stiffness& stiffness, bool lumped);

/// K_bar = K + a0 M + a1 C_d (theory.md section 5), in the same pattern.
SparseMatrix effective_stiffness(const SparseMatrix& K, const SparseMatrix& M, const Rayleigh& damping,
                                 const Newmark& newmark);

}  // namespace palpate
