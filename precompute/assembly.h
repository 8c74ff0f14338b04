// Assembly of the stiffness matrix.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>;

/// K of the free nodes: clamped dofs are removed. Free dof 3 a + axis belongs to free node a.
struct Stiffness {
  std::vector<Index> free_nodes;    ///< [n/3] mesh node of each free node, ascending
  std::vector<Index> free_of_node;  ///< [N] free node of each mesh node, -1 where it is clamped
  SparseMatrix K;  ///< [n, n] lower triangle [N/m]; the 3x3 block of each pair of neighbours is complete
};

/// K = sum over elements of V B^T D B (theory.md section 1), for one material.
/// `fixed` [N] marks clamped nodes; at least one node must be free.
Stiffness assemble_stiffness(const Mesh& mesh, const Material& material,
                             const std::vector<std::uint8_t>& fixed);

}  // namespace palpate
