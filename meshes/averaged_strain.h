// Linear tetrahedra whose strain is averaged over edges and nodes, so that they do not lock.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

/// Elements of one material around an edge or a node. An element's volume is divided equally among its edges,
/// and once more among its nodes.
struct StrainDomain {
  bool is_of_edge = false;
  Index material = 0;
  double volume = 0.0;         ///< [m^3]
  std::vector<Index> nodes;    ///< of its elements, ascending
  Eigen::MatrixX3d gradients;  ///< [nodes x 3] of the shape functions, their mean by volume [1/m]
};

/// Visits the domains of edges, then those of nodes, of a mesh of tet4a (selective smoothed finite elements,
/// Liu & Nguyen-Thoi 2010). The energy of the shear modulus mu, and that of lambda up to 2 mu, is of the
/// strain averaged over each edge, that of the rest of lambda of the strain averaged over each node: neither
/// bending nor incompressibility locks, and volumes that change from one node to the next by turns are still
/// resisted (docs/measurements/accuracy.md). Materials are averaged apart.
void for_each_strain_domain(const Mesh& mesh, std::span<const Index> material_of_element,
                            const std::function<void(const StrainDomain&)>& visit);

/// Stiffness of a domain [3 nodes x 3 nodes] [N/m], dof 3 node + axis.
Eigen::MatrixXd domain_stiffness(const StrainDomain& domain, const Material& material);

}  // namespace palpate
