// Linear tetrahedron: constant strain, one quadrature point (Fagerholt, isoparametric tetrahedra; theory.md
// section 1).
#pragma once

#include <Eigen/Core>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate::tet4 {

using Corners = Eigen::Matrix<double, 3, 4>;        ///< columns are the corner positions [m]
using Gradients = Eigen::Matrix<double, 4, 3>;      ///< row i is grad N_i [1/m]
using StrainMatrix = Eigen::Matrix<double, 6, 12>;  ///< B
using Stiffness = Eigen::Matrix<double, 12, 12>;    ///< K_e [N/m], node-major dofs

/// Corner positions of one element.
Corners corners(const Mesh& mesh, const Tet& tet);

/// Signed volume [m^3], positive for positively oriented elements.
double volume(const Corners& x);

/// Gradients of the four shape functions; the element must not be flat.
Gradients gradients(const Corners& x);

/// B with B u_e = [eps_xx eps_yy eps_zz gamma_xy gamma_yz gamma_zx].
StrainMatrix strain_matrix(const Gradients& g);

/// K_e = V B^T D B.
Stiffness stiffness(const Corners& x, const Matrix6& D);

}  // namespace palpate::tet4
