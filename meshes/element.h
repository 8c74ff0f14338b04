// Isoparametric elements: shape functions, quadrature, strain matrix and element integrals (theory.md
// section 1; Fagerholt, chapter 3). One interface for every kind; no heap.
#pragma once

#include <Eigen/Core>
#include <span>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

/// A point of the reference element and its weight; the weights add up to the reference element's measure.
struct QuadraturePoint {
  Vec3 xi;  ///< in the unit simplex for triangles and tetrahedra, in [-1, 1]^d for line2, quad4 and hex8
  double weight;
};

using ShapeValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_element_nodes, 1>;
/// [nodes, d] row i is grad N_i.
using ShapeGradients = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_element_nodes, 3>;
/// [nodes, 3] row i is the position of node i [m].
using ElementNodes = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, max_element_nodes, 3>;
using StrainMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 3 * max_element_nodes>;
using ElementMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 * max_element_nodes, 3 * max_element_nodes>;
using ElementVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3 * max_element_nodes, 1>;

/// N_i at xi.
ShapeValues shape_functions(ElementType type, const Vec3& xi);

/// dN_i/dxi_k at xi. [nodes, reference dimension]
ShapeGradients reference_gradients(ElementType type, const Vec3& xi);

/// Gauss points that integrate B^T D B exactly on straight-edged simplices (tri3, tet4: 1; tet10: 4) and
/// affine quad4 (2 x 2) and hex8 (2 x 2 x 2), and N exactly on flat facets (line2: 2; tri6: 3).
std::span<const QuadraturePoint> quadrature(ElementType type);

/// Reference coordinates of the nodes.
std::span<const Vec3> reference_nodes(ElementType type);

/// Positions of the nodes of element e.
ElementNodes element_nodes(const Mesh& mesh, Index e);
/// Positions of the given nodes.
ElementNodes positions(const Mesh& mesh, std::span<const Index> nodes);

/// Shape gradients in space at a point, and the determinant of the map there. Elements of full dimension.
struct MappedGradients {
  ShapeGradients gradients;  ///< [nodes, d] [1/m]
  double determinant;        ///< of dx/dxi; positive for positively oriented elements
};
MappedGradients mapped_gradients(ElementType type, const ElementNodes& x, const Vec3& xi);

/// Length or area of a facet (line2, tri3, tri6, quad4) in space per unit of the reference facet, at xi.
double facet_measure(ElementType type, const ElementNodes& x, const Vec3& xi);

/// Volume of the element [m^3]; in the plane its area [m^2].
double element_volume(ElementType type, const ElementNodes& x);

/// Smallest determinant of the map at quadrature points and corners: positive for a valid element.
double smallest_determinant(ElementType type, const ElementNodes& x);

/// Strain matrix B: B u_e = [eps_xx eps_yy eps_zz gamma_xy gamma_yz gamma_zx], in the plane
/// [eps_xx eps_yy gamma_xy]; u_e node-major.
StrainMatrix strain_matrix(const ShapeGradients& gradients);

/// K_e = integral of t B^T D B [N/m]; `thickness` t [m] is that of a plane body, 1 in space.
ElementMatrix element_stiffness(ElementType type, const ElementNodes& x, const ElasticityMatrix& D,
                                double thickness);

/// Consistent mass matrix: the integral of t density N_i N_j over the element [kg], the same along every
/// axis. Exact on straight-edged simplices and on affine quad4 and hex8.
using ElementMass =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_element_nodes, max_element_nodes>;
ElementMass element_mass(ElementType type, const ElementNodes& x, double density, double thickness);

/// Diagonal of the lumped mass matrix [kg]: that of the consistent one, scaled to keep the element's mass
/// (Hinton, Rock and Zienkiewicz 1976); positive for every kind of element.
ShapeValues element_lumped_mass(ElementType type, const ElementNodes& x, double density, double thickness);

/// Integral of t B^T sigma for a constant stress [N], e.g. D eps_0 (Fagerholt eq. 3.25-3.30).
ElementVector element_stress_force(ElementType type, const ElementNodes& x, const StressVector& stress,
                                   double thickness);

/// Integral of t N_i over the element [m^3]; times a body force [N/m^3] it is the nodal force.
ShapeValues element_shape_integrals(ElementType type, const ElementNodes& x, double thickness);

/// Integral of t N_i over a facet [m^2]; times a traction [N/m^2] it is the nodal force.
ShapeValues facet_shape_integrals(ElementType type, const ElementNodes& x, double thickness);

}  // namespace palpate
