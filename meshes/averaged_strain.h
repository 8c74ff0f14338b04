// Linear tetrahedra whose strain is averaged over edges and nodes, so that they do not lock.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

/// Strain domain of tet4a (selective smoothed finite elements, Liu & Nguyen-Thoi 2010): the elements of one
/// material around an edge or a node, with the mean of their strain. Each element's volume is divided equally
/// among its edges, and once more among its nodes.
struct StrainDomain {
  bool is_of_edge = false;
  Index material = 0;
  double volume = 0.0;         ///< [m^3]
  std::vector<Index> nodes;    ///< of its elements, ascending
  Eigen::MatrixX3d gradients;  ///< [nodes x 3] of the shape functions, their mean by volume [1/m]
};

/// Visits the strain domains of all edges of a mesh.
void for_each_edge_domain(const Mesh& mesh, std::span<const Index> material_of_element,
                          const std::function<void(const StrainDomain&)>& visit);
/// Visits the strain domains of all nodes of a mesh.
void for_each_node_domain(const Mesh& mesh, std::span<const Index> material_of_element,
                          const std::function<void(const StrainDomain&)>& visit);

/// Stiffness of a strain domain [3 nodes x 3 nodes] [N/m], dof 3 node + axis: of an edge that of the shear
/// modulus mu and of lambda up to 2 mu, of a node that of the rest of lambda. So neither bending nor
/// incompressibility locks, and volumes that alternate from node to node are still resisted
/// (docs/measurements/accuracy.md).
Eigen::MatrixXd domain_stiffness(const StrainDomain& domain, const Material& material);

}  // namespace palpate
