// Touches for judging stored Green's functions: displacements of some nodes, whose forces are compared.
#pragma once

#include <Eigen/Core>
#include <random>
#include <span>

#include "meshes/mesh.h"
#include "precompute/numerics/refined_solve.h"

namespace palpate {

/// A random number in [-1, 1), the same on every machine.
double uniform(std::mt19937_64& random);

/// Displacements [d m, d + 3] of m nodes, one per column: along each axis, by a linear field, and twice at
/// random. `arms` [m] are the nodes' positions relative to the first [m].
Eigen::MatrixXd touch_displacements(std::span<const Vec3> arms, int d, std::mt19937_64& random);

/// max |f - f_0| / max |f_0| over the nodes of a touch, the largest of its displacements [d m,
/// displacements].
double force_error(const RefinedSolution::Refined& f, const RefinedSolution::Refined& f_0, int d);

/// max |f - f_0| / max |f_0| over the nodes and displacements, with f = C^-1 u and f_0 = reference^-1 u;
/// infinity if C is not positive definite. For the nodes of u, the first ones of both matrices.
double touch_error(const RefinedSolution::Refined& reference, const Eigen::MatrixXd& C,
                   const Eigen::MatrixXd& u, int d);

}  // namespace palpate
