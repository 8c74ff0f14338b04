// Internal forces of a live body, their energy and their tangent.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "statics/live_body.h"

namespace palpate {

/// Sums over the elements.
struct ForceSums {
  double energy = 0.0;  ///< of all elements [J]
  Index inverted = 0;   ///< quadrature points of zero or negative volume, which are tolerated
};

/// Deformation gradient at a quadrature point, in the plane with F_33 = 1. `x` [d N] positions [m].
Mat3 deformation_gradient(const LiveBody& body, const Eigen::VectorXd& x, Index point) noexcept;

/// f [d N] = -dE/dx, the forces of the elements on their nodes, held ones too [N]. `plastic`
/// strain of each quadrature point, or empty for none.
ForceSums internal_forces(const LiveBody& body, const Eigen::VectorXd& x, std::span<const Mat3> plastic,
                          Eigen::VectorXd& f);

/// Fills `K`, of the body's pattern, with -df/dx of the free dofs (lower triangle) [N/m].
void assemble_tangent(const LiveBody& body, const Eigen::VectorXd& x, std::span<const Mat3> plastic,
                      TangentKind kind, LiveMatrix& K);

}  // namespace palpate
